"""Text as pictures: captions and legend, in the font that comes with Pillow."""

from __future__ import annotations

from PIL import Image, ImageDraw, ImageFont

from graspatlas.viewer.scene.captions import Caption
from graspatlas.viewer.scene.scene import Colour

__all__ = ["ALARM", "DARK", "GREY", "LINE", "SMALL", "caption_image", "legend_image", "text_image"]

#: Colours of the text.
DARK = (28, 34, 44)
GREY = (92, 100, 112)
#: That of what is wrong.
ALARM = (176, 0, 28)


#: Height of the letters below a title and an index, as a share of the title's, and of a line as one of its letters'.
SMALL, LINE = 0.58, 1.32


def text_image(lines: list[tuple[str, float, tuple[int, int, int]]]) -> Image.Image:
    """Centred lines on a transparent ground.

    Args:
        lines: Text, height of its letters in pixels, and colour of each line.
    """
    fonts = [ImageFont.load_default(size=max(size, 6.0)) for _, size, _ in lines]
    widths = [font.getlength(text) for (text, _, _), font in zip(lines, fonts, strict=True)]
    width, height = int(max(widths)) + 8, int(sum(LINE * size for _, size, _ in lines)) + 4
    # Transparent pixels have the colour of the text: no dark seam where they are blended.
    image = Image.new("RGBA", (width, height), (*GREY, 0))
    pen = ImageDraw.Draw(image)
    y = 0.0
    for (text, size, colour), font, length in zip(lines, fonts, widths, strict=True):
        pen.text(((width - length) / 2.0, y), text, font=font, fill=(*colour, 255))
        y += LINE * size
    return image


def caption_image(words: Caption, size: float) -> Image.Image:
    """A caption; `size` is the height of its title in pixels."""
    lines = [(words.title, size, DARK), (words.quality, 0.68 * size, DARK)]
    lines += [(words.motion, SMALL * size, GREY)] if words.motion else []
    return text_image(lines + [(alarm, SMALL * size, ALARM) for alarm in words.alarms])


def legend_image(entries: list[tuple[Colour, str]], size: float) -> Image.Image:
    """A row of coloured dots, each with what its colour stands for; `size` is the height of the letters in pixels."""
    font = ImageFont.load_default(size=max(size, 6.0))
    dot, gap = 0.85 * size, 1.9 * size
    lengths = [font.getlength(text) for _, text in entries]
    width = int(sum(lengths) + len(entries) * 1.5 * dot + (len(entries) - 1) * gap) + 4
    large = 4
    dots = Image.new("RGBA", (width * large, int(1.5 * size) * large), (*GREY, 0))
    pen, x, starts = ImageDraw.Draw(dots), 0.0, []
    for (colour, _), length in zip(entries, lengths, strict=True):
        fill = tuple(round(255.0 * c) for c in colour[:3])
        opacity = 255 if colour[3] >= 1.0 else 150
        box = [(x, 0.28 * size), (x + dot, 0.28 * size + dot)]
        pen.ellipse([(large * a, large * b) for a, b in box], fill=(*fill, opacity))
        starts.append(x + 1.5 * dot)
        x += 1.5 * dot + length + gap
    image = dots.resize((width, int(1.5 * size)), Image.Resampling.LANCZOS)
    pen = ImageDraw.Draw(image)
    for start, (_, text) in zip(starts, entries, strict=True):
        pen.text((start, 0.05 * size), text, font=font, fill=(*GREY, 255))
    return image
