// Colours: viridis, which all eyes can order and which stays in order without colour; and those of the page.

const VIRIDIS = [
  [68, 1, 84], [72, 26, 108], [71, 47, 125], [65, 68, 135], [57, 86, 140], [49, 104, 142], [42, 120, 142],
  [35, 136, 142], [31, 152, 139], [34, 168, 132], [53, 183, 121], [84, 197, 104], [122, 209, 81], [165, 219, 54],
  [210, 226, 27], [253, 231, 37],
];

// Red, green and blue, 0 to 255, of a share from 0 to 1, written to `out` at `at`.
function viridis(share, out, at) {
  const place = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
  const i = Math.min(Math.floor(place), VIRIDIS.length - 2), t = place - i;
  for (let c = 0; c < 3; c++) out[at + c] = VIRIDIS[i][c] + t * (VIRIDIS[i + 1][c] - VIRIDIS[i][c]);
}

// All of them from left to right, on a canvas of 256 pixels.
function drawScale(canvas) {
  const context = canvas.getContext("2d"), picture = context.createImageData(256, 1);
  for (let i = 0; i < 256; i++) {
    viridis(i / 255, picture.data, 4 * i);
    picture.data[4 * i + 3] = 255;
  }
  context.putImageData(picture, 0, 0);
}

// A colour of the page by its name in the style sheet.
function pageColour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

function rgbOf(colour) {
  const { r, g, b } = new THREE.Color(colour);
  return [r, g, b].map((c) => Math.round(255 * c));
}

function cssOf([red, green, blue]) {
  return `rgb(${[red, green, blue].map((c) => Math.round(255 * c)).join(", ")})`;
}

// Dark or light: as the system has it, until somebody chooses.
function startTheme(changed) {
  const system = matchMedia("(prefers-color-scheme: dark)"), root = document.documentElement;
  const set = (dark) => {
    root.dataset.theme = dark ? "dark" : "light";
    changed();
  };
  system.addEventListener("change", () => set(system.matches));
  byId("theme").addEventListener("click", () => set(root.dataset.theme !== "dark"));
  set(system.matches);
}

// A white disc, for round points.
function disc() {
  const canvas = element("canvas", { width: 32, height: 32 }), context = canvas.getContext("2d");
  context.fillStyle = "#fff";
  context.arc(16, 16, 15, 0, 2 * Math.PI);
  context.fill();
  return new THREE.CanvasTexture(canvas);
}
