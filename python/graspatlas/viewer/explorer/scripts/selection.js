// What is chosen, the same for all parts of the page: index, requirements, range, and the grasps that are shown.

const MOST_PINS = 2;

class Selection {
  constructor(numbers, graph) {
    this.graph = graph;
    this.count = facts.n_charts + facts.maxima.length;
    this.columns = facts.indices.map((_, i) => numbers.get(`index_${i}`));
    this.rejections = numbers.get("rejections");
    this.enabled = facts.requirements.map(() => true);
    this.index = 0;
    this.range = null; // from the histogram
    this.log = this.chosenLog = false;
    this.pins = [];
    this.current = -1; // what is pointed at or walked to
    this.listeners = { view: [], grasps: [] };
    this.counts = new Uint8Array(facts.n_charts); // 1 where the requirements that are switched on are met
    this.inside = new Uint8Array(facts.n_charts); // and the value is in the range
    this.screen();
    this.log = this.skewed(this.index);
    const varies = (i) => { const [low, high] = this.extent(i); return i > 0 && high > low; };
    this.other = Math.max(facts.indices.findIndex((_, i) => varies(i)), 0);
  }

  on(what, listener) {
    this.listeners[what].push(listener);
  }

  tell(what) {
    const started = performance.now();
    for (const listener of this.listeners[what]) listener();
    this.milliseconds = performance.now() - started; // script time of the last change, without drawing
  }

  get values() {
    return this.columns[this.index];
  }

  // Change what is shown of all grasps: index, other, enabled, range or log.
  change(changes) {
    if ("index" in changes && changes.index !== this.index) this.range = null;
    Object.assign(this, changes);
    this.screen();
    if ("log" in changes) this.chosenLog = true;
    else if (!this.chosenLog && !this.range) this.log = this.skewed(this.index);
    this.tell("view");
  }

  screen() {
    let mask = 0;
    this.enabled.forEach((on, bit) => { if (on) mask |= 1 << bit; });
    const [low, high] = this.range || [-Infinity, Infinity], values = this.values;
    for (let i = 0; i < facts.n_charts; i++) {
      this.counts[i] = Number((this.rejections[i] & mask) === 0);
      this.inside[i] = Number(this.counts[i] && values[i] >= low && values[i] <= high);
    }
  }

  // Whether any grasp meets the requirements that are switched on, and its value is in the range.
  allows(grasp) {
    if (grasp < facts.n_charts) return this.inside[grasp] === 1;
    const met = this.enabled.every((on, bit) => !on || !((this.rejections[grasp] >> bit) & 1));
    const [low, high] = this.range || [-Infinity, Infinity], value = this.values[grasp];
    return met && value >= low && value <= high;
  }

  // The best chart (sign 1) or the worst (-1) by the index among those that count; -1 if none does.
  extreme(sign) {
    const { values, counts } = this;
    let found = -1;
    for (let i = 0; i < facts.n_charts; i++)
      if (counts[i] && (found < 0 || sign * values[i] > sign * values[found])) found = i;
    return found;
  }

  // Least and largest finite value of an index among the charts that count, or among all if none does.
  extent(index = this.index) {
    const values = this.columns[index];
    let low = Infinity, high = -Infinity;
    for (const any of [false, true]) {
      if (low <= high) break;
      for (let i = 0; i < facts.n_charts; i++)
        if ((any || this.counts[i]) && Number.isFinite(values[i])) {
          low = Math.min(low, values[i]);
          high = Math.max(high, values[i]);
        }
    }
    return low <= high ? [low, high] : [0, 1];
  }

  // Whether few charts have so large a value that all others would look alike.
  skewed(index) {
    const values = [...this.columns[index].subarray(0, facts.n_charts)].filter((value, i) => this.counts[i] && Number.isFinite(value));
    values.sort((a, b) => a - b);
    const [low, high, most] = [0, 1, 0.95].map((share) => values[Math.floor(share * (values.length - 1))]);
    return values.length > 1 && low >= 0 && high - low > 20 * (most - low) && most > low;
  }

  // From 0 to 1 along the colours and the histogram, and along an axis.
  scaled([low, high] = this.extent(), log = this.log) {
    if (!log) return (value) => (high > low ? (value - low) / (high - low) : 0.5);
    const least = Math.max(low, high * 1e-12), span = Math.log(high / least);
    return (value) => (span > 0 ? Math.log(Math.max(value, least) / least) / span : 0.5);
  }

  // The grasps that are shown, one or two: pinned ones, the last of which gives way to one that is pointed at.
  get shown() {
    if (this.current < 0 || this.pins.includes(this.current)) return this.pins.length ? this.pins : [Math.max(this.current, 0)];
    return [...this.pins.slice(0, MOST_PINS - 1), this.current];
  }

  // The grasp that keys walk on from, and that the address names.
  get focus() {
    return this.current >= 0 ? this.current : this.shown[this.shown.length - 1];
  }

  point(grasp) {
    if (grasp === this.current) return;
    this.current = grasp;
    this.tell("grasps");
  }

  // What is pointed at is left: two pinned grasps come back, one stays beside what was pointed at last.
  leave() {
    if (this.pins.length === MOST_PINS) this.point(-1);
  }

  pin(grasp) {
    if (this.pins.includes(grasp)) return this.unpin(grasp);
    this.pins = [...this.pins.slice(0, MOST_PINS - 1), grasp];
    this.current = grasp;
    this.tell("grasps");
  }

  unpin(grasp) {
    this.pins = this.pins.filter((pin) => pin !== grasp);
    if (!this.pins.length) this.current = grasp;
    else if (this.current === grasp) this.current = -1;
    this.tell("grasps");
  }

  show(...pins) {
    this.pins = pins.slice(0, MOST_PINS);
    this.current = -1;
    this.tell("grasps");
  }

  clear() {
    this.current = this.focus;
    this.pins = [];
    this.tell("grasps");
  }

  chartOf(grasp) {
    return grasp < facts.n_charts ? grasp : facts.maxima[grasp - facts.n_charts].chart;
  }

  // What a grasp is called, and where it is.
  title(grasp) {
    if (grasp >= facts.n_charts) {
      const { status, all_motions: free, title } = facts.maxima[grasp - facts.n_charts];
      if (title) return [title, status];
      const first = grasp === facts.n_charts ? "Best grasp, refined" : `Refined maximum ${grasp - facts.n_charts + 1}`;
      return [first + (free ? ", all motions free" : ""), status === "maximum" ? "" : status];
    }
    const names = [];
    if (grasp === facts.best && !facts.maxima.length) names.push("Best grasp");
    else if (grasp === facts.best) names.push("Best chart");
    if (grasp === facts.worst) names.push("Worst grasp");
    if (grasp === facts.nearest) names.push("Nearest to an accepted grasp");
    if (grasp === 0) names.push("x\u2081, the first grasp");
    return [names.join(", ") || `Chart ${grasp}`, names.length ? `chart ${grasp}` : ""];
  }

  // The length of a step between neighbours: the turns of the joints, and how the object moves and turns.
  stepLength(grasps) {
    const positions = grasps.numbers.get("positions"), xyz = grasps.numbers.get("object_xyz");
    const quat = grasps.numbers.get("object_quat");
    return (a, b) => {
      let sum = 0, dot = 0;
      facts.joints.forEach((joint, j) => {
        let step = positions.get(b, j) - positions.get(a, j);
        if (joint.prismatic) step /= facts.length_scale;
        else step = Math.atan2(Math.sin(step), Math.cos(step));
        sum += step * step;
      });
      for (let c = 0; c < 3; c++) sum += ((xyz.get(b, c) - xyz.get(a, c)) / facts.length_scale) ** 2;
      for (let c = 0; c < 4; c++) dot += quat.get(a, c) * quat.get(b, c);
      return Math.sqrt(sum + (2 * Math.acos(Math.min(1, Math.abs(dot)))) ** 2);
    };
  }
}
