// Puts the parts together: controls, the address, and the path from pin to pin.

const CHARTS_A_SECOND = 14;
const STRIPED = "repeating-linear-gradient(45deg, #d60d17 0 2px, #fcf2ed 2px 4px)";

class Controls {
  constructor(selection, atlas, hand) {
    Object.assign(this, { selection, atlas, hand });
    this.menus();
    this.requirements();
    this.layers();
    this.jumps();
    selection.on("view", () => this.scale());
    this.scale();
  }

  menus() {
    const { selection, atlas } = this;
    const labels = facts.indices.map(({ label }) => label);
    fill(byId("index"), labels, selection.index, (index) => selection.change({ index }));
    fill(byId("other"), labels, selection.other, (other) => selection.change({ other }));
    const names = { surface: "surface", flat: "flat", points: "points" };
    fill(byId("mode"), atlas.modes.map((mode) => names[mode]), 0, (i) => {
      atlas.build(atlas.modes[i]);
      byId("axes").hidden = atlas.mode !== "points";
    });
    byId("axes").hidden = atlas.mode !== "points";
    [0, 1, 2].forEach((c) => {
      const axes = () => [0, 1, 2].map((k) => byId(`axis-${k}`).selectedIndex);
      fill(byId(`axis-${c}`), atlas.coordinates.map(([name]) => name), c, () => atlas.build("points", axes()));
    });
    byId("log").addEventListener("change", ({ target }) => selection.change({ log: target.checked }));
  }

  // A switch for each requirement, and one that hides what is grey.
  requirements() {
    const { selection, atlas } = this, bar = byId("requirements");
    facts.requirements.forEach(({ label, name }, bit) => {
      const rejected = selection.rejections.subarray(0, facts.n_charts).reduce((sum, bits) => sum + ((bits >> bit) & 1), 0);
      const box = checkbox(`${label} (rejects ${rejected})`, true, (on) => {
        const enabled = [...selection.enabled];
        enabled[bit] = on;
        selection.change({ enabled });
      });
      box.title = name;
      bar.append(box);
    });
    bar.append(checkbox("hide grey", false, (hidden) => {
      atlas.hidden = hidden;
      atlas.paint();
    }));
  }

  layers() {
    const css = ({ colour }) => cssOf(colour);
    const shown = [
      ["contact", "contact points", css({ colour: facts.colours.contact }), true],
      ["normal", "normals, out of the object", css({ colour: facts.colours.normal }), true],
      ["ellipsoid", "velocities that the joints give the object", css({ colour: facts.colours.ellipsoid }), true],
      ["force", "contact forces", cssOf(FORCE_COLOUR), false],
      ["object", "object", "", true],
    ];
    const { object, palm } = facts.shapes.obstacles;
    if (object.length || palm.length) shown.push(["obstacles", "obstacles", "", true]);
    if (facts.rejected.stripes.length) shown.push(["clash", "shapes that collide, red and white", STRIPED, true]);
    byId("layers").append(...shown.map(([name, text, colour, on]) => {
      const box = checkbox(text, on, (checked) => {
        this.hand.layers({ [name]: checked });
        this.selection.tell("grasps");
      });
      if (colour) box.insertBefore(dot(colour), box.lastChild);
      return box;
    }));
  }

  jumps() {
    const { selection } = this;
    const go = (chart) => { if (chart >= 0) selection.point(chart); };
    byId("best").addEventListener("click", () => go(selection.extreme(1)));
    byId("worst").addEventListener("click", () => go(selection.extreme(-1)));
    byId("first").addEventListener("click", () => go(0));
    byId("maximum").addEventListener("click", () => {
      const maxima = selection.graph.localMaxima(selection.values, selection.counts);
      go(maxima.length ? maxima[(maxima.indexOf(selection.focus) + 1) % maxima.length] : -1);
    });
    const refined = facts.maxima.length;
    byId("refined").hidden = !refined;
    byId("refined").addEventListener("click", () => {
      const at = selection.focus - facts.n_charts;
      go(refined ? facts.n_charts + ((Math.max(at, -1) + 1) % refined) : -1);
    });
  }

  // The colour bar with its ends and the unit.
  scale() {
    const { selection } = this, index = facts.indices[selection.index], [low, high] = selection.extent();
    byId("log").checked = selection.log;
    byId("scale-low").textContent = short(low);
    byId("scale-high").textContent = short(high);
    byId("scale-unit").textContent = [index.label, index.unit, selection.log ? "logarithmic" : ""].filter(Boolean).join(", ");
    drawScale(byId("scale-bar"));
  }
}

function fill(select, names, chosen, changed) {
  offer(select, ...names);
  select.selectedIndex = chosen;
  select.addEventListener("change", () => changed(select.selectedIndex));
}

function offer(select, ...names) {
  select.append(...names.map((name) => element("option", { textContent: name })));
}

function checkbox(text, checked, changed) {
  const input = element("input", { type: "checkbox", checked });
  input.addEventListener("change", () => changed(input.checked));
  return element("label", {}, input, ` ${text}`);
}

function dot(colour) {
  const made = element("span", { className: "dot" });
  made.style.background = colour;
  return made;
}

// The way from one pinned grasp to the other, from chart to neighbouring chart; all of them keep the contacts.
class PathPlayer {
  constructor(selection, grasps, atlas) {
    Object.assign(this, { selection, grasps, atlas, chain: null, ends: "" });
    this.button = byId("path");
    this.slider = byId("frame");
    this.button.addEventListener("click", () => (this.playing ? this.stop() : this.play()));
    this.slider.addEventListener("input", () => {
      this.stop();
      this.show(Number(this.slider.value));
    });
    selection.on("grasps", () => this.check());
    selection.on("view", () => { this.ends = ""; this.check(); });
    this.check();
  }

  // Forget the path when other grasps are pinned.
  check() {
    const { pins } = this.selection, ends = pins.join();
    const [from, to] = pins.map((pin) => this.selection.chartOf(pin)); // -1 of a maximum that no chart leads to
    this.button.disabled = pins.length < 2 || from === to || Math.min(from, to) < 0;
    if (this.playing && this.selection.current !== this.expected) this.stop(); // somebody has chosen another grasp
    if (ends === this.ends) return;
    this.ends = ends;
    this.chain = null;
    this.stop();
    this.slider.hidden = byId("path-text").hidden = true;
    this.atlas.showTrail(null);
  }

  find() {
    const { selection } = this, { graph } = selection;
    const [from, to] = selection.pins.map((pin) => selection.chartOf(pin)), length = selection.stepLength(this.grasps);
    const everywhere = new Uint8Array(facts.n_charts).fill(1);
    const accepted = graph.shortestChain(from, to, selection.counts, length);
    this.chain = accepted || graph.shortestChain(from, to, everywhere, length);
    this.slider.hidden = !this.chain;
    byId("path-text").hidden = false;
    byId("path-text").textContent = this.chain ? this.describe(accepted, length) : "No chain of charts joins these two.";
    if (!this.chain) return;
    this.slider.max = this.chain.length - 1;
    this.atlas.showTrail(this.chain);
  }

  describe(accepted, length) {
    const total = this.chain.slice(1).reduce((sum, chart, i) => sum + length(this.chain[i], chart), 0);
    const met = this.selection.enabled.some(Boolean)
      ? accepted ? " and meets the requirements" : "; not all of them meet the requirements, no such chain does" : "";
    return `The shortest chain of neighbouring charts: ${this.chain.length} grasps, length ${short(total, 3)}. Each is a grasp of the atlas`
      + ` that keeps all contacts${met}. For the smooth shortest path between them: graspatlas path OUT --from ${this.chain[0]} --to ${this.chain[this.chain.length - 1]}.`;
  }

  play() {
    if (!this.chain) this.find();
    if (!this.chain) return;
    const first = Number(this.slider.value) >= this.chain.length - 1 ? 0 : Number(this.slider.value);
    const started = performance.now() - (1000 * first) / CHARTS_A_SECOND;
    this.playing = true;
    this.button.textContent = "\u25a0 path";
    const advance = (now) => {
      if (!this.playing) return;
      const at = Math.min(Math.floor(((now - started) / 1000) * CHARTS_A_SECOND), this.chain.length - 1);
      this.show(Math.max(at, 0));
      if (at >= this.chain.length - 1) this.stop();
      else requestAnimationFrame(advance);
    };
    requestAnimationFrame(advance);
  }

  stop() {
    this.playing = false;
    this.button.textContent = "\u25b6 path";
  }

  show(at) {
    this.slider.value = at;
    this.expected = this.chain[at];
    this.selection.point(this.chain[at]);
  }
}

// The address names the grasps: page.html#chart=12, or #chart=12,40 for two; a refined maximum is named after the charts.
class Address {
  constructor(selection) {
    this.selection = selection;
    window.addEventListener("hashchange", () => this.follow());
    selection.on("grasps", () => this.write());
    if (!this.follow()) this.open();
  }

  follow() {
    const found = location.hash.match(/chart=([\d,]+)/);
    const grasps = found ? found[1].split(",").map(Number).filter((grasp) => grasp < this.selection.count) : [];
    if (grasps.length && grasps.join() !== this.selection.shown.join()) this.selection.show(...grasps);
    return grasps.length > 0;
  }

  open() {
    const { selection } = this;
    if (facts.opens_at !== null) selection.show(facts.opens_at);
    else {
      const best = facts.maxima.length ? facts.n_charts : facts.best;
      selection.show(...new Set([best, facts.worst].filter((grasp) => grasp !== null)));
    }
  }

  // Soon, since browsers count how often it changes.
  write() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      const hash = `#chart=${this.selection.shown.join()}`;
      if (hash === location.hash) return;
      try {
        history.replaceState(null, "", hash);
      } catch {} // a page within another one has no address of its own
    }, 150);
  }
}

async function start() {
  const numbers = await Numbers.load();
  const selection = new Selection(numbers, new Graph(numbers));
  const grasps = new Grasps(numbers);
  document.documentElement.dataset.theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
  const atlas = new AtlasView(numbers, selection), hand = new HandView(numbers, selection, grasps);
  const table = new NumbersTable(selection, hand);
  const controls = new Controls(selection, atlas, hand);
  new Histogram(selection);
  const scatter = new Scatter(selection);
  const path = new PathPlayer(selection, grasps, atlas);
  new Keys(selection, atlas);
  const address = new Address(selection);
  startTheme(() => selection.tell("view"));
  const parts = { facts, selection, grasps, atlas, hand, table, path, scatter, controls, address };
  window.graspatlas = parts; // for whoever looks from the console
  document.documentElement.dataset.ready = "yes";
  return parts;
}

const started = start();
started.catch((error) => {
  document.querySelector("header p").textContent = `The page cannot be shown: ${error.message}`;
  throw error;
});
