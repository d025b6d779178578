// The keyboard: walk from chart to chart, and what the buttons do.

const HELP = [
  ["point", "shows the grasp of a chart at once"],
  ["click, tap", "pins it; two pinned grasps stand side by side"],
  ["drag, one finger", "turns; with Shift, the right button or two fingers: shifts"],
  ["wheel, pinch", "comes nearer"],
  ["arrow keys", "walk to the neighbouring chart in that direction"],
  ["Enter, space", "pins or unpins it"],
  ["Escape", "unpins all"],
  ["b, w, x", "best, worst, first grasp (x\u2081)"],
  ["m", "next local maximum: a chart that no neighbour beats"],
  ["r", "next refined maximum, between the charts"],
  ["p", "plays the path from one pinned grasp to the other"],
  ["f", "fits the atlas into its window"],
];

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

class Keys {
  constructor(selection, atlas) {
    Object.assign(this, { selection, atlas });
    this.buttons = { b: "best", w: "worst", x: "first", m: "maximum", r: "refined", p: "path" };
    window.addEventListener("keydown", (event) => this.pressed(event));
    byId("help-list").append(...HELP.flatMap(([key, what]) =>
      [element("dt", { textContent: key }), element("dd", { textContent: what })]));
    byId("help-button").addEventListener("click", () => byId("help").showModal());
  }

  pressed(event) {
    const { key, target } = event;
    if (event.ctrlKey || event.metaKey || event.altKey || byId("help").open) return;
    if (target.matches("select, input[type=range]")) return;
    if (key in ARROWS) this.walk(...ARROWS[key]);
    else if (key === "Escape") this.selection.clear();
    else if ((key === "Enter" || key === " ") && !target.matches("button, input")) this.selection.pin(this.selection.focus);
    else if (key in this.buttons) byId(this.buttons[key]).click();
    else if (key === "f") this.atlas.refit();
    else if (key === "?") byId("help").showModal();
    else return;
    event.preventDefault();
  }

  walk(dx, dy) {
    const chart = this.selection.chartOf(this.selection.focus);
    const next = chart < 0 ? -1 : this.atlas.neighbourTowards(chart, dx, dy);
    if (next >= 0) this.selection.point(next);
  }
}
