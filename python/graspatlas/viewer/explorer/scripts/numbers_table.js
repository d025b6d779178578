// The numbers of the grasps that are shown: as a table, as words, and to copy.

class NumbersTable {
  constructor(selection, hand) {
    Object.assign(this, { selection, hand, root: byId("table"), words: byId("words") });
    this.waiting = false;
    selection.on("grasps", () => this.request());
    selection.on("view", () => this.request());
    byId("copy-json").addEventListener("click", () => this.copy(`${JSON.stringify(this.file(), null, 2)}\n`, "JSON"));
    byId("copy-yaml").addEventListener("click", () => this.copy(yaml(this.file()), "YAML"));
    byId("copy-link").addEventListener("click", () => this.copy(location.href, "link"));
  }

  // Once a frame at most, after hand and atlas have been drawn.
  request() {
    if (this.waiting) return;
    this.waiting = true;
    setTimeout(() => {
      this.waiting = false;
      this.update();
    }, 30);
  }

  update() {
    const reads = this.hand.reads();
    this.words.replaceChildren(...this.explanation(reads));
    const head = element("tr", {}, element("th"), ...reads.map(({ grasp }, i) =>
      element("th", { textContent: (this.selection.pins.includes(grasp) ? `${"AB"[i]}: ` : "") + this.selection.title(grasp).filter(Boolean).join(", ") })));
    const rows = this.rows(reads).map(([name, cells]) =>
      element("tr", {}, element("th", { textContent: name, scope: "row" }), ...cells.map((cell) =>
        element("td", { textContent: cell, className: cell.startsWith("\u2717") ? "no" : "" }))));
    this.root.replaceChildren(element("table", {}, element("thead", {}, head), element("tbody", {}, ...rows)));
  }

  rows(reads) {
    const { selection } = this, of = (text) => reads.map(text), rows = [];
    facts.indices.forEach(({ label, unit }, i) => {
      rows.push([unit ? `${label} (${unit})` : label, of(({ grasp }) => short(selection.columns[i][grasp], 5))]);
    });
    facts.requirements.forEach(({ label }, bit) => {
      rows.push([label, of(({ grasp }) => ((selection.rejections[grasp] >> bit) & 1 ? "\u2717 not met" : "\u2713 met"))]);
    });
    rows.push(["semi-axes of object velocities (lengths in mm)", of(({ semiAxes }) => semiAxes.map((axis) => short(axis, 4)).join(", "))]);
    rows.push(["object in palm, x y z [mm]", of(({ object: T }) => [T[3], T[7], T[11]].map((c) => (1000 * c).toFixed(2)).join(", "))]);
    rows.push(["its quaternion x y z w", of(({ object }) => quaternionOf(object).map((c) => c.toFixed(4)).join(", "))]);
    facts.joints.forEach(({ name, prismatic }, j) => {
      rows.push([name, of(({ positions }) => jointText(positions[j], prismatic))]);
    });
    facts.contacts.forEach(({ frame }, i) => {
      rows.push([`contact ${i + 1}, ${frame}: force [N]`, of(({ contacts }) => forceText(contacts[i].force))]);
    });
    rows.push(["neighbours", of(({ grasp }) => (grasp < facts.n_charts ? [...selection.graph.neighbours(grasp)].join(", ") : "\u2013"))]);
    return rows;
  }

  // What the index counts, with the numbers of the grasps that are shown.
  explanation(reads) {
    const { selection } = this, index = facts.indices[selection.index];
    const lines = [element("p", {}, element("b", { textContent: index.label }), index.unit ? ` (${index.unit}): ` : ": ", index.text)];
    if (index.rule)
      for (const [i, read] of reads.entries()) {
        const letter = reads.length > 1 ? (selection.pins.includes(read.grasp) ? `${"AB"[i]}: ` : "pointed at: ") : "";
        lines.push(element("p", { textContent: letter + countText(index.rule, read, selection.values[read.grasp]) }));
      }
    if (index.rule) lines.push(element("p", { textContent: drawnText(reads) }));
    lines.push(...this.also(reads));
    if (this.hand.visible.force) lines.push(element("p", { textContent: forcesText(reads) }));
    return lines;
  }

  // What else is said of the grasps; a page that a server answers knows more.
  also() {
    return [];
  }

  // The grasps in the format of save_grasps, rounded as in this page.
  file() {
    const reads = this.hand.reads(), { file } = facts;
    const joints = Object.fromEntries(facts.joints.map(({ name, prismatic }) => [name, prismatic ? "m" : "rad"]));
    return {
      ...file,
      units: { xyz: "m", point: "m", quat_xyzw: "unit quaternion x y z w", joints },
      requirements: facts.requirements.map(({ name }) => name),
      status: facts.status,
      n_charts: facts.n_charts,
      n_grasps: reads.length,
      grasps: reads.map((read) => this.record(read)),
    };
  }

  record({ grasp, positions, object, contacts }) {
    const { selection } = this, palm = inverted(object);
    const pose = (T) => ({ xyz: [T[3], T[7], T[11]].map(rounded), quat_xyzw: quaternionOf(T).map(rounded) });
    const value = (i) => (Number.isFinite(selection.columns[i][grasp]) ? Number(selection.columns[i][grasp].toPrecision(8)) : null);
    return {
      chart: selection.chartOf(grasp),
      refined: grasp >= facts.n_charts && !facts.maxima[grasp - facts.n_charts].sample,
      accepted: selection.rejections[grasp] === 0,
      indices: Object.fromEntries(facts.indices.map(({ name }, i) => [name, value(i)])),
      joints: Object.fromEntries(facts.joints.map(({ name }, j) => [name, rounded(positions[j])])),
      palm_in_object: pose(palm),
      object_in_palm: pose(object),
      contacts: contacts.map(({ frame, point, normal }) => ({
        frame, point: transformed(palm, point).map(rounded), normal: rotated(palm, normal).map(rounded),
      })),
    };
  }

  async copy(text, what) {
    try {
      await navigator.clipboard.writeText(text);
    } catch { // not allowed: by way of a selection
      const area = element("textarea", { value: text });
      document.body.append(area);
      area.select();
      document.execCommand("copy");
      area.remove();
    }
    byId("copied").textContent = `${what} copied`;
    this.copied = text;
    setTimeout(() => { byId("copied").textContent = ""; }, 2500);
  }
}

const rounded = (value) => Number(value.toFixed(6));

function jointText(position, prismatic) {
  if (prismatic) return `${(1000 * position).toFixed(3)} mm`;
  return `${position.toFixed(4)} rad, ${((180 * position) / Math.PI).toFixed(1)}\u00b0`;
}

function forceText(force) {
  if (force.some(Number.isNaN)) return "none holds";
  return `${short(Math.hypot(...force), 3)} (${force.map((c) => c.toFixed(2)).join(", ")})`;
}

// How the value follows from the semi-axes.
function countText(rule, { semiAxes }, value) {
  const axes = semiAxes.filter((axis) => axis > 0).reverse(), list = axes.map((axis) => short(axis, 3));
  if (!axes.length) return "all semi-axes are 0: the joints do not move the object.";
  if (rule === "product") return `${list.join(" \u00d7 ")} = ${short(value)}, ${axes.length} semi-axes.`;
  const least = list[list.length - 1];
  if (rule === "smallest") return `the smallest of ${list.join(", ")} is ${least}.`;
  return `${least} / ${list[0]} = ${short(value)}.`;
}

// What is drawn, compared with what is counted.
function drawnText(reads) {
  const n = facts.translations, all = facts.planar ? 3 : 6;
  const lengths = reads.map(({ ellipsoid }) => ellipsoid.lengths.slice(0, n).map((l) => short(1000 * l, 3)).join(", "));
  return `Drawn are only the velocities of the object's origin: ${n} semi-axes of ${lengths.join("; and ")} mm per rad, longest first, `
    + `each ellipsoid to its own scale. The index counts ${all} semi-axes, turns of the object too, `
    + "so that the grasp with the larger ellipsoid can have the smaller index.";
}

function forcesText(reads) {
  const without = reads.filter(({ contacts }) => contacts.some(({ force }) => force.some(Number.isNaN))).length;
  const given = `friction ${facts.friction}${facts.torsional ? `, torsional ${facts.torsional} m` : ""}`;
  const text = `Contact forces: those that hold the object, farthest from their friction cones (${given}), on average 5 N a contact along the normal.`;
  return without ? `${text} ${without === reads.length ? "No" : "For one grasp no"} forces hold: no force closure with this friction.` : text;
}

// Plain data as YAML; texts are quoted as in JSON, which YAML reads.
function yaml(value, indent = "") {
  const plain = (item) => item === null || typeof item !== "object";
  const flat = (item) => plain(item) || (Array.isArray(item) && item.every(plain));
  const one = (item) => (Array.isArray(item) ? `[${item.map((i) => JSON.stringify(i)).join(", ")}]` : JSON.stringify(item));
  const key = (name) => (/^[A-Za-z_]\w*$/.test(name) && !/^(y|n|yes|no|on|off|true|false|null)$/i.test(name) ? name : JSON.stringify(name));
  if (Array.isArray(value))
    return value.map((item) => `${indent}- ${yaml(item, `${indent}  `).trimStart()}`).join("");
  return Object.entries(value)
    .map(([name, item]) => `${indent}${key(name)}:${flat(item) ? ` ${one(item)}\n` : `\n${yaml(item, `${indent}  `)}`}`)
    .join("");
}
