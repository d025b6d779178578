"""graspatlas regions: what it prints and writes, and what it refuses."""

from __future__ import annotations

import json

import numpy as np
import pytest
import shapes
import yaml
from PIL import Image

from graspatlas.cli import main
from graspatlas.patches import patch_from_dict


@pytest.fixture
def mug(tmp_path):
    shapes.mug().export(tmp_path / "mug.ply")
    return tmp_path / "mug.ply"


def test_regions_are_listed_written_and_drawn(mug, tmp_path, capsys):
    out, picture = tmp_path / "regions.yaml", tmp_path / "regions.png"
    assert main(["regions", str(mug), "--output", str(out), "--picture", str(picture)]) == 0
    printed = capsys.readouterr().out
    assert "1472 faces in 2 pieces" in printed
    names = ["cylinder_1", "inner_cylinder_1", "plane_1", "plane_2", "torus_1", "plane_3"]
    assert [line.split()[0] for line in printed.splitlines()[2:-1]] == names
    stored = yaml.safe_load(out.read_text())
    assert [region["name"] for region in stored["regions"]] == names
    assert patch_from_dict(stored["regions"][0]["patch"]).radius == pytest.approx(0.04, abs=2e-4)
    image = np.asarray(Image.open(picture).convert("RGB"), float)
    assert image.shape == (900, 1600, 3)
    # Blue, of the largest region, is seen from both sides, and the legend is not empty.
    blue = (image[..., 2] > 1.5 * image[..., 0]) & (image[..., 2] > 100.0)
    assert blue[:700, :800].mean() > 0.01
    assert blue[:700, 800:].mean() > 0.01
    assert (image[-80:] < 150.0).any()


def test_json_and_scale(tmp_path, capsys):
    mesh = shapes.can()
    mesh.apply_scale(1000.0)
    mesh.export(tmp_path / "can.stl")
    assert main(["regions", str(tmp_path / "can.stl")]) == 2
    assert "say scale 0.001" in capsys.readouterr().err
    assert main(["regions", str(tmp_path / "can.stl"), "--scale", "0.001", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [region["name"] for region in found["regions"]] == ["cylinder_1", "plane_1", "plane_2"]
    assert found["regions"][0]["area"] == pytest.approx(2 * np.pi * 0.033 * 0.12, rel=0.01)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nowhere.ply"], "there is no mesh file"),
        (["MUG", "--scale", "0"], "scale must be a positive number"),
        (["MUG", "--tolerance", "-1"], "tolerance must be a positive number"),
        (["MUG", "--crease", "200"], "crease must be above 0"),
        (["MUG", "--smallest", "2"], "smallest must be above 0 and at most 1"),
        (["MUG", "--picture", "mug.jpg"], "must end in .png"),
        (["MUG", "--output", "."], "it is a folder"),
    ],
)
def test_wrong_words_are_refused(words, message, mug, capsys):
    assert main(["regions", *(str(mug) if word == "MUG" else word for word in words)]) == 2
    assert message in capsys.readouterr().err
