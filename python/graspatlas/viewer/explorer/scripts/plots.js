// Plots on canvas: how many grasps have which value, with a brush; and two indices against each other.

const BINS = 48;

// A canvas with pixels of the screen; returns its context, width and height in pixels of the page.
function prepared(canvas) {
  const ratio = Math.min(devicePixelRatio, 2), { clientWidth: width, clientHeight: height } = canvas;
  canvas.width = Math.max(1, Math.round(width * ratio));
  canvas.height = Math.max(1, Math.round(height * ratio));
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.font = "11px system-ui, sans-serif";
  return { context, width, height };
}

// A plot whose marks change with every grasp, and whose picture stays until something else changes.
class Plot {
  constructor(canvas, selection) {
    Object.assign(this, { canvas, selection });
    new ResizeObserver(() => this.redraw()).observe(canvas);
    selection.on("view", () => this.redraw());
    selection.on("grasps", () => this.draw());
  }

  redraw() {
    const { context, width, height } = prepared(this.canvas);
    if (!width) return;
    Object.assign(this, { context, width, height, ink: pageColour("ink") });
    this.paint(context, width, height);
    this.picture = context.getImageData(0, 0, this.canvas.width, this.canvas.height);
    this.draw();
  }

  draw() {
    if (!this.picture) return;
    this.context.putImageData(this.picture, 0, 0);
    this.context.fillStyle = this.ink;
    this.selection.shown.forEach((grasp, i) => {
      this.mark(this.context, grasp, this.selection.pins.includes(grasp) ? "AB"[i] : "");
    });
  }
}

class Histogram extends Plot {
  constructor(selection) {
    super(byId("histogram"), selection);
    this.canvas.addEventListener("pointerdown", (event) => this.down(event));
    this.canvas.addEventListener("pointermove", (event) => this.move(event));
    this.canvas.addEventListener("pointerup", (event) => this.up(event));
    byId("unbrush").addEventListener("click", () => selection.change({ range: null }));
  }

  count() {
    const { selection } = this, bins = new Float64Array(BINS);
    for (let i = 0; i < facts.n_charts; i++)
      if (selection.counts[i] && Number.isFinite(selection.values[i]))
        bins[Math.min(BINS - 1, Math.max(0, Math.floor(this.scale(selection.values[i]) * BINS)))]++;
    return bins;
  }

  paint(context, width, height) {
    const { selection } = this, base = height - 16;
    this.scale = selection.scaled();
    const bins = this.count(), most = Math.max(...bins, 1), colour = new Uint8Array(3), grey = pageColour("refused");
    const [from, to] = selection.range ? selection.range.map(this.scale) : [0, 1];
    bins.forEach((count, i) => {
      const middle = (i + 0.5) / BINS;
      viridis(middle, colour, 0);
      context.fillStyle = middle >= from && middle <= to ? `rgb(${colour.join()})` : grey;
      // The root lets bars of few grasps be seen beside those of thousands.
      const high = count ? Math.max(2, Math.sqrt(count / most) * (base - 6)) : 0;
      context.fillRect((i * width) / BINS, base - high, width / BINS - 0.6, high);
    });
    context.fillStyle = pageColour("soft");
    context.fillRect(0, base, width, 1);
    this.labels(context, width, height);
    if (selection.range) {
      context.strokeStyle = pageColour("accent");
      context.strokeRect(from * width + 0.5, 1.5, Math.max((to - from) * width, 1), base - 2);
    }
    this.say();
  }

  mark(context, grasp, letter) {
    const x = Math.min(Math.max(this.scale(this.selection.values[grasp]), 0), 1) * (this.width - 2) + 1;
    if (Number.isNaN(x)) return;
    context.fillRect(x - 0.75, 2, 1.5, this.height - 18);
    context.fillText(letter, x + 12 > this.width ? x - 10 : x + 3, 11);
  }

  labels(context, width, height) {
    const [low, high] = this.selection.extent();
    context.fillText(short(low, 3), 0, height - 3);
    const text = short(high, 3);
    context.fillText(text, width - context.measureText(text).width, height - 3);
  }

  say() {
    const { selection } = this, total = selection.inside.reduce((sum, one) => sum + one, 0);
    const all = selection.counts.reduce((sum, one) => sum + one, 0), range = selection.range;
    byId("histogram-text").textContent = range
      ? `${total} of ${all} from ${short(range[0], 3)} to ${short(range[1], 3)}`
      : `${all} of ${facts.n_charts} grasps (heights are roots); drag for a range`;
    byId("unbrush").hidden = !range;
  }

  // The value at a place of the canvas.
  value(event) {
    const box = this.canvas.getBoundingClientRect(), [low, high] = this.selection.extent();
    const share = Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1);
    if (!this.selection.log) return low + share * (high - low);
    const least = Math.max(low, high * 1e-12);
    return share === 0 ? low : least * Math.exp(share * Math.log(high / least));
  }

  down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.from = { value: this.value(event), x: event.clientX };
  }

  move(event) {
    if (!this.from || Math.abs(event.clientX - this.from.x) < 3) return;
    const ends = [this.from.value, this.value(event)].sort((a, b) => a - b);
    this.selection.change({ range: ends });
  }

  up(event) {
    if (this.from && Math.abs(event.clientX - this.from.x) < 3) this.selection.change({ range: null });
    this.from = null;
  }
}

class Scatter extends Plot {
  constructor(selection) {
    super(byId("scatter"), selection);
    this.canvas.addEventListener("pointermove", (event) => this.hover(event));
    this.canvas.addEventListener("pointerleave", () => selection.leave());
    this.canvas.addEventListener("click", (event) => {
      const chart = this.pick(event);
      if (chart >= 0) selection.pin(chart);
    });
  }

  // Places of all charts, those that count on top of the others, and the front.
  paint(context, width, height) {
    const { selection } = this, base = height - 16;
    const x = selection.columns[selection.index], y = selection.columns[selection.other];
    const across = this.scale(selection.index, width, 8), up = this.scale(selection.other, base, 8);
    const places = (this.places = new Float32Array(2 * facts.n_charts)), { inside } = selection;
    for (let i = 0; i < facts.n_charts; i++) {
      places[2 * i] = across(x[i]);
      places[2 * i + 1] = base - up(y[i]);
    }
    for (const [which, colour, size] of [[0, "refused", 1.5], [1, "accent", facts.n_charts > 2e4 ? 1.5 : 2.5]]) {
      context.fillStyle = pageColour(colour);
      for (let i = 0; i < facts.n_charts; i++)
        if (inside[i] === which) context.fillRect(places[2 * i] - size / 2, places[2 * i + 1] - size / 2, size, size);
    }
    this.drawFront(context);
    context.fillStyle = pageColour("soft");
    context.fillRect(0, base, width, 1);
    const text = `${facts.indices[selection.index].label} \u2192`;
    context.fillText(text, width - context.measureText(text).width, height - 3);
    context.fillText(`\u2191 ${facts.indices[selection.other].label}`, 2, 11);
  }

  scale(index, length, margin) {
    const { selection } = this, extent = selection.extent(index);
    const log = index === selection.index ? selection.log : selection.skewed(index), share = selection.scaled(extent, log);
    return (value) => margin + Math.min(Math.max(share(value), 0), 1) * (length - 2 * margin);
  }

  // Charts that no other beats by both indices, by falling first one.
  front() {
    const { selection } = this, x = selection.columns[selection.index], y = selection.columns[selection.other];
    const charts = [];
    for (let i = 0; i < facts.n_charts; i++) if (selection.inside[i]) charts.push(i);
    charts.sort((a, b) => x[b] - x[a] || y[b] - y[a] || a - b);
    let highest = -Infinity;
    return charts.filter((i) => {
      const keep = y[i] > highest;
      highest = Math.max(highest, y[i]);
      return keep;
    });
  }

  drawFront(context) {
    const front = this.front();
    context.strokeStyle = context.fillStyle = pageColour("ink");
    context.beginPath();
    front.forEach((i, k) => {
      const [x, y] = this.places.subarray(2 * i, 2 * i + 2);
      if (k) context.lineTo(x, this.places[2 * front[k - 1] + 1]);
      context.lineTo(x, y);
    });
    context.stroke();
    for (const i of front) context.fillRect(this.places[2 * i] - 2, this.places[2 * i + 1] - 2, 4, 4);
    const same = this.selection.index === this.selection.other;
    byId("front-text").textContent = same ? "" : `Pareto front: ${front.length} grasp${front.length === 1 ? "" : "s"}`;
  }

  mark(context, grasp, letter) {
    if (grasp >= facts.n_charts) return;
    const [x, y] = this.places.subarray(2 * grasp, 2 * grasp + 2);
    for (const [colour, width] of [["#000", 4], ["#fff", 2]]) {
      context.beginPath();
      context.arc(x, y, 5.5, 0, 2 * Math.PI);
      Object.assign(context, { strokeStyle: colour, lineWidth: width });
      context.stroke();
    }
    context.lineWidth = 1;
    context.fillText(letter, x + 18 > this.width ? x - 17 : x + 9, Math.max(y - 4, 10));
  }

  // The chart nearest to the pointer, those that count first, or -1.
  pick(event) {
    const box = this.canvas.getBoundingClientRect(), x = event.clientX - box.left, y = event.clientY - box.top;
    let found = -1, least = 14;
    for (let i = 0; i < facts.n_charts; i++) {
      const far = Math.hypot(this.places[2 * i] - x, this.places[2 * i + 1] - y) + (this.selection.inside[i] ? 0 : 6);
      if (far < least) [found, least] = [i, far];
    }
    return found;
  }

  hover(event) {
    const chart = this.pick(event);
    if (chart >= 0) this.selection.point(chart);
  }
}
