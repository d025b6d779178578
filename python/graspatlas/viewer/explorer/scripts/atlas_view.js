// The atlas: charts as polygons in three coordinates or unrolled, or as points in three chosen ones.

const REACH = 16; // how near to a point one must point [pixels]

class AtlasView {
  constructor(numbers, selection) {
    Object.assign(this, { numbers, selection });
    this.canvas = byId("atlas-canvas");
    this.overlay = byId("atlas-overlay");
    this.scene = new THREE.Scene();
    this.stage = new Stage(this.canvas, (width, height) => this.draw(width, height));
    this.orbit = new Orbit(this.canvas, {
      changed: () => this.stage.request(),
      hovered: (x, y) => this.hover(x, y),
      tapped: (x, y) => this.tap(x, y),
      left: () => selection.leave(),
    });
    this.scene.add(new THREE.AmbientLight(0xffffff, 0.72));
    this.lamp = new THREE.DirectionalLight(0xffffff, 0.34);
    this.scene.add(this.lamp, this.lamp.target);
    this.axes = [0, 1, 2];
    this.hidden = false;
    this.coordinates = this.choices();
    this.marks = [];
    this.trail = null;
    this.build(numbers.has("corners") ? "surface" : "points");
    selection.on("view", () => this.paint());
    selection.on("grasps", () => this.mark());
  }

  get modes() {
    return this.numbers.has("corners") ? ["surface", "flat", "points"] : ["points"];
  }

  // Coordinates that points can be drawn in: names, and the column of each when it is needed.
  choices() {
    const column = (name, c) => () => this.numbers.get(name).column(c);
    return [
      ...facts.layout.labels.map((label, c) => [label || `p${c + 1}`, column("coordinates", c)]),
      ...["x", "y", "z"].map((axis, c) => [`object ${axis} [m]`, column("object_xyz", c)]),
      ...facts.joints.map(({ name, prismatic }, j) => [`${name} [${prismatic ? "m" : "rad"}]`, column("positions", j)]),
      ...facts.indices.map(({ label }, i) => [label, () => Float64Array.from(this.selection.columns[i])]),
    ];
  }

  build(mode, axes = this.axes) {
    Object.assign(this, { mode, axes });
    for (const old of [this.faces, this.edges, this.points, this.others, this.frame, this.trail]) {
      if (!old) continue;
      this.scene.remove(old);
      old.geometry.dispose();
      old.material.dispose();
    }
    this.faces = this.edges = this.points = this.others = this.frame = this.trail = null;
    if (mode === "points") this.buildPoints();
    else this.buildPolygons();
    this.buildFrame();
    this.orbit.flat = mode === "flat";
    [this.orbit.azimuth, this.orbit.elevation] = mode === "flat" ? [-Math.PI / 2, Math.PI / 2 - 1e-4] : [0.6, 0.5];
    this.orbit.reset();
    this.paint();
  }

  buildPolygons() {
    const flat = this.mode === "flat";
    const corners = this.normalised(this.numbers.get(flat ? "flat_corners" : "corners").flat(), flat ? 2 : 3);
    const counts = this.numbers.get("corner_counts");
    this.starts = new Uint32Array(facts.n_charts + 1);
    counts.forEach((count, i) => { this.starts[i + 1] = this.starts[i] + count; });
    this.corners = corners;
    this.centers = this.centersOf(corners, flat);
    const outline = [];
    for (let i = 0; i < facts.n_charts; i++)
      for (let a = this.starts[i]; a < this.starts[i + 1]; a++)
        outline.push(a, a + 1 < this.starts[i + 1] ? a + 1 : this.starts[i]);
    const position = new THREE.BufferAttribute(corners, 3);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", position);
    geometry.setAttribute("normal", new THREE.BufferAttribute(this.normals(), 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(new Uint8Array(corners.length), 3, true));
    const look = { vertexColors: true, side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
    const Material = flat ? THREE.MeshBasicMaterial : THREE.MeshLambertMaterial;
    this.faces = new THREE.Mesh(geometry, new Material(look));
    const lines = new THREE.BufferGeometry();
    lines.setAttribute("position", position);
    lines.setIndex(new THREE.BufferAttribute(Uint32Array.from(outline), 1));
    this.edges = new THREE.LineSegments(lines, new THREE.LineBasicMaterial({ transparent: true, opacity: 0.28 }));
    this.scene.add(this.faces, this.edges);
  }

  // Middles of the polygons, and after them the refined maxima.
  centersOf(corners, flat) {
    const centers = new Float32Array(3 * this.selection.count).fill(NaN);
    for (let i = 0; i < facts.n_charts; i++)
      for (let c = 0; c < 3; c++) {
        let sum = 0;
        for (let a = this.starts[i]; a < this.starts[i + 1]; a++) sum += corners[3 * a + c];
        centers[3 * i + c] = sum / (this.starts[i + 1] - this.starts[i]);
      }
    facts.maxima.forEach((maximum, m) => {
      const i = facts.n_charts + m;
      if (maximum.all_motions) return; // it is not on this surface
      for (let c = 0; c < 3; c++)
        centers[3 * i + c] = flat
          ? maximum.flat ? ((maximum.flat[c] ?? 0) - this.middle[c]) / this.size : centers[3 * maximum.chart + c]
          : (this.numbers.get("coordinates").get(i, c) - this.middle[c]) / this.size;
    });
    return centers;
  }

  // Unit normals of the polygons, one for each corner.
  normals() {
    const { corners, starts } = this, normals = new Float32Array(corners.length);
    const [a, b, n] = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
    for (let i = 0; i < facts.n_charts; i++) {
      const first = starts[i];
      n.set(0, 0, 0);
      for (let k = first + 1; k + 1 < starts[i + 1]; k++) {
        for (const [vector, at] of [[a, k], [b, k + 1]])
          vector.set(corners[3 * at] - corners[3 * first], corners[3 * at + 1] - corners[3 * first + 1], corners[3 * at + 2] - corners[3 * first + 2]);
        n.add(a.cross(b));
      }
      n.normalize();
      for (let k = first; k < starts[i + 1]; k++) n.toArray(normals, 3 * k);
    }
    return normals;
  }

  // Coordinates [n, columns] moved and scaled into a box of half-width one, as rows of three.
  normalised(rows, columns, each = false) {
    const n = rows.length / columns, out = new Float32Array(3 * n);
    this.low = [0, 0, 0];
    this.high = [0, 0, 0];
    this.middle = [0, 0, 0];
    const halves = [0, 0, 0];
    for (let c = 0; c < columns; c++) {
      let low = Infinity, high = -Infinity;
      for (let i = 0; i < n; i++) {
        const value = rows[i * columns + c];
        if (value < low) low = value;
        if (value > high) high = value;
      }
      [this.low[c], this.high[c], this.middle[c]] = [low, high, (low + high) / 2];
      halves[c] = (high - low) / 2 || 1e-9;
    }
    this.size = Math.max(...halves);
    this.scales = halves.map((half) => (each ? half : this.size));
    for (let i = 0; i < n; i++)
      for (let c = 0; c < columns; c++) out[3 * i + c] = (rows[i * columns + c] - this.middle[c]) / this.scales[c];
    return out;
  }

  // The chosen coordinates of all grasps, as rows of three.
  pointRows() {
    const rows = new Float32Array(3 * this.selection.count);
    this.axes.map((choice) => this.coordinates[choice][1]()).forEach((column, c) =>
      column.forEach((value, i) => { rows[3 * i + c] = Number.isFinite(value) ? value : NaN; }));
    facts.maxima.forEach((maximum, m) => {
      const i = 3 * (facts.n_charts + m);
      if (maximum.all_motions) rows.fill(NaN, i, i + 3); // it is not among the charts
    });
    return rows;
  }

  // More grasps have come; what is seen stays where it is.
  extend() {
    if (this.mode !== "points") this.centers = this.centersOf(this.corners, this.mode === "flat");
    else this.centers = this.pointRows().map((value, i) => (value - this.middle[i % 3]) / this.scales[i % 3]);
    this.paint();
  }

  buildPoints() {
    const principal = this.axes.every((choice) => choice < 3);
    this.centers = this.normalised(this.pointRows(), 3, !principal);
    const position = new THREE.BufferAttribute(this.centers.slice(0, 3 * facts.n_charts), 3);
    const colours = new THREE.BufferAttribute(new Uint8Array(3 * facts.n_charts), 3, true);
    const made = [1, 0.6].map((size) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", position);
      geometry.setAttribute("color", colours);
      geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(), 2);
      const pixels = (facts.n_charts > 3e4 ? 3.2 : 6) * size;
      const look = { size: pixels * this.stage.renderer.getPixelRatio(), sizeAttenuation: false, vertexColors: true };
      const points = new THREE.Points(geometry, new THREE.PointsMaterial({ ...look, map: disc(), alphaTest: 0.5 }));
      this.scene.add(points);
      return points;
    });
    [this.points, this.others] = made;
  }

  // Three axes from the corner with the least coordinates, with their names.
  buildFrame() {
    for (const label of this.labels || []) label.remove();
    const half = this.scales.map((scale, c) => (this.high[c] - this.low[c]) / 2 / scale);
    const corner = half.map((h) => -1.04 * h - 0.03);
    const names = this.mode === "points" ? this.axes.map((choice) => this.coordinates[choice][0]) : facts.layout.labels;
    const places = [], flat = this.mode === "flat";
    this.labels = flat ? [] : names.map((name) => element("span", { className: "axis-label", textContent: name }));
    this.ends = [0, 1, 2].map((c) => {
      const end = [...corner];
      end[c] = half[c];
      if (!flat) places.push(...corner, ...end);
      return new THREE.Vector3(...end);
    });
    this.overlay.append(...this.labels);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(places), 3));
    this.frame = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial());
    this.scene.add(this.frame);
    const extent = flat ? [half[0], half[1], 0] : half;
    this.box = [];
    for (const x of [-1, 1]) for (const y of [-1, 1]) for (const z of [-1, 1]) this.box.push(x * extent[0], y * extent[1], z * extent[2]);
  }

  // The whole atlas in the window again.
  refit() {
    this.orbit.reset();
    this.stage.request();
  }

  // Colour the charts, and leave out those that are hidden.
  paint() {
    const { counts, inside, values } = this.selection, scale = this.selection.scaled();
    const grey = rgbOf(pageColour("refused"));
    const colours = new Uint8Array(3 * facts.n_charts);
    for (let i = 0; i < facts.n_charts; i++) {
      if (inside[i]) viridis(scale(values[i]), colours, 3 * i);
      else colours.set(grey, 3 * i);
    }
    if (this.faces) this.paintPolygons(colours);
    else this.paintPoints(colours);
    if (this.added) this.added.paint();
    this.frame.material.color.set(pageColour("soft"));
    this.stage.request();
  }

  drawn(i) {
    return !this.hidden || this.selection.inside[i] === 1;
  }

  paintPolygons(colours) {
    const { array } = this.faces.geometry.attributes.color, { starts } = this, fans = [];
    for (let i = 0; i < facts.n_charts; i++) {
      if (!this.drawn(i)) continue;
      for (let k = starts[i]; k < starts[i + 1]; k++) {
        for (let c = 0; c < 3; c++) array[3 * k + c] = colours[3 * i + c];
        if (k > starts[i] && k + 1 < starts[i + 1]) fans.push(starts[i], k, k + 1);
      }
    }
    this.faces.geometry.attributes.color.needsUpdate = true;
    this.faces.geometry.setIndex(new THREE.BufferAttribute(Uint32Array.from(fans), 1));
    this.edges.visible = !this.hidden;
    this.edges.material.color.set(document.documentElement.dataset.theme === "dark" ? 0x000000 : 0x182030);
  }

  paintPoints(colours) {
    const attribute = this.points.geometry.attributes.color;
    attribute.array.set(colours);
    attribute.needsUpdate = true;
    const { inside } = this.selection;
    [1, 0].forEach((which) => {
      const rows = [];
      for (let i = 0; i < facts.n_charts; i++) if (inside[i] === which) rows.push(i);
      const points = which ? this.points : this.others;
      points.geometry.setIndex(new THREE.BufferAttribute(Uint32Array.from(rows), 1));
      points.visible = which === 1 || !this.hidden;
    });
  }

  // Draw a chain of charts as a line.
  showTrail(chain) {
    if (this.trail) this.scene.remove(this.trail);
    this.trail = null;
    if (chain) {
      const places = chain.flatMap((chart) => [...this.centers.subarray(3 * chart, 3 * chart + 3)]);
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(places), 3));
      const look = { color: 0xff5a36, depthTest: false, transparent: true };
      this.trail = new THREE.Line(geometry, new THREE.LineBasicMaterial(look));
      this.trail.renderOrder = 3;
      this.scene.add(this.trail);
    }
    this.stage.request();
  }

  draw(width, height) {
    const { orbit, stage } = this;
    orbit.fit(this.box, width / height, this.mode === "flat" ? 1.04 : 1.08);
    orbit.update(width / height);
    this.lamp.position.copy(orbit.camera.position);
    this.lamp.target.position.copy(orbit.target).add(orbit.pan);
    this.lamp.target.updateMatrixWorld();
    stage.renderer.render(this.scene, orbit.camera);
    this.name(width, height);
    this.mark();
  }

  // Put the names of the axes at their ends.
  name(width, height) {
    this.labels.forEach((label, c) => {
      const { x, y } = this.project(this.ends[c], width, height), wide = label.offsetWidth || 60;
      const left = Math.min(Math.max(x - wide / 2, 2), width - wide - 2), top = Math.min(Math.max(y - 9, 2), height - 20);
      label.style.transform = `translate(${left}px, ${top}px)`;
    });
  }

  // Mark the grasps that are shown.
  mark() {
    const { selection } = this, { clientWidth: width, clientHeight: height } = this.canvas;
    const wanted = selection.shown.map((grasp, i) => [grasp, selection.pins.includes(grasp) ? "AB"[i] : ""]);
    while (this.marks.length > wanted.length) this.marks.pop().remove();
    while (this.marks.length < wanted.length) {
      this.marks.push(element("span", { className: "marker" }));
      this.overlay.append(this.marks[this.marks.length - 1]);
    }
    wanted.forEach(([grasp, letter], i) => {
      const place = new THREE.Vector3().fromArray(this.centers, 3 * grasp), known = !Number.isNaN(place.x);
      const { x, y } = known ? this.project(place, width, height) : { x: 0, y: 0 };
      this.marks[i].hidden = !known;
      this.marks[i].className = letter ? "marker pin" : "marker";
      if (this.marks[i].textContent !== letter) this.marks[i].textContent = letter;
      this.marks[i].style.transform = `translate(${x}px, ${y}px)`;
    });
  }

  project(place, width, height) {
    const seen = place.clone().project(this.orbit.camera);
    return { x: ((seen.x + 1) * width) / 2, y: ((1 - seen.y) * height) / 2, depth: seen.z };
  }

  hover(x, y) {
    const chart = this.pick(x, y);
    if (chart >= 0) this.selection.point(chart);
    else this.selection.leave();
    this.canvas.style.cursor = chart >= 0 ? "pointer" : "grab";
  }

  tap(x, y) {
    const chart = this.pick(x, y);
    if (chart >= 0) this.selection.pin(chart);
  }

  // The chart at a place of the canvas, or -1.
  pick(x, y) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (this.orbit.pointers.size > 1) return -1;
    this.orbit.update(width / height);
    const added = this.added ? this.added.pick(x, y, width, height) : -1;
    if (added >= 0) return added;
    return this.faces ? this.pickPolygon(x, y, width, height) : this.pickPoint(x, y, width, height);
  }

  // The nearest polygon on the ray of a pixel; only those are looked at whose middle is near it.
  pickPolygon(x, y, width, height) {
    const caster = new THREE.Raycaster();
    caster.setFromCamera({ x: (2 * x) / width - 1, y: 1 - (2 * y) / height }, this.orbit.camera);
    const { origin: o, direction: d } = caster.ray, { centers, corners, starts } = this;
    this.radius = this.radius || {};
    const near = (this.radius[this.mode] ||= this.largestRadius()) ** 2;
    const [a, b, c, hit] = [0, 0, 0, 0].map(() => new THREE.Vector3());
    let found = -1, distance = Infinity;
    for (let i = 0; i < facts.n_charts; i++) {
      const px = centers[3 * i] - o.x, py = centers[3 * i + 1] - o.y, pz = centers[3 * i + 2] - o.z;
      const along = px * d.x + py * d.y + pz * d.z;
      if (px * px + py * py + pz * pz - along * along > near || along > distance + 1 || !this.drawn(i)) continue;
      a.fromArray(corners, 3 * starts[i]);
      for (let k = starts[i] + 1; k + 1 < starts[i + 1]; k++) {
        b.fromArray(corners, 3 * k);
        c.fromArray(corners, 3 * k + 3);
        if (!caster.ray.intersectTriangle(a, b, c, false, hit)) continue;
        const far = hit.distanceTo(o);
        if (far < distance) [found, distance] = [i, far];
      }
    }
    return found;
  }

  largestRadius() {
    let largest = 0;
    for (let i = 0; i < facts.n_charts; i++)
      for (let k = this.starts[i]; k < this.starts[i + 1]; k++) {
        let sum = 0;
        for (let c = 0; c < 3; c++) sum += (this.corners[3 * k + c] - this.centers[3 * i + c]) ** 2;
        largest = Math.max(largest, sum);
      }
    return Math.sqrt(largest);
  }

  // The point nearest to a pixel; of those that hide each other the one in front, and those that count first.
  pickPoint(x, y, width, height) {
    const M = new THREE.Matrix4().multiplyMatrices(this.orbit.camera.projectionMatrix, this.orbit.camera.matrixWorldInverse);
    const e = M.elements, { centers } = this;
    let found = -1, least = Infinity;
    for (let i = 0; i < facts.n_charts; i++) {
      const px = centers[3 * i], py = centers[3 * i + 1], pz = centers[3 * i + 2];
      const w = e[3] * px + e[7] * py + e[11] * pz + e[15];
      const dx = (((e[0] * px + e[4] * py + e[8] * pz + e[12]) / w + 1) * width) / 2 - x;
      const dy = ((1 - (e[1] * px + e[5] * py + e[9] * pz + e[13]) / w) * height) / 2 - y;
      const far = Math.hypot(dx, dy);
      if (!(far < REACH) || !this.drawn(i)) continue;
      const cost = Math.max(far, 3) + (this.selection.inside[i] ? 0 : 8) + (4 * w) / this.orbit.reach;
      if (cost < least) [found, least] = [i, cost];
    }
    return found;
  }

  // The neighbour of a chart that lies most in a direction on the screen, or -1.
  neighbourTowards(chart, dx, dy) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const at = (i) => this.project(new THREE.Vector3().fromArray(this.centers, 3 * i), width, height);
    const from = at(chart);
    let found = -1, best = 0.35; // the cosine of the widest angle
    for (const other of this.selection.graph.neighbours(chart)) {
      const { x, y } = at(other), length = Math.hypot(x - from.x, y - from.y);
      const towards = length > 0 ? ((x - from.x) * dx + (y - from.y) * dy) / length : 0;
      if (towards > best) [found, best] = [other, towards];
    }
    return found;
  }
}
