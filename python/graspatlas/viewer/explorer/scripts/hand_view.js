// The hand with the object: one grasp, or two side by side, in one canvas.

const FORCE_COLOUR = [0.0, 0.52, 0.42];
// How much of what is drawn on top shows through what hides it.
const SHOWN_THROUGH = { contact: 0.5, normal: 0.45, force: 0.45, ellipsoid: 0.13, clash: 0.5 };
// Opacity of what gives way to shapes that collide, and the layers that do.
const FADED = 0.16, HIDDEN_BY_A_CLASH = ["contact", "normal", "ellipsoid"];
// Lamps about the camera (right, up, backwards) and their intensity.
const LAMPS = [[[-0.55, 0.9, 0.75], 0.62], [[0.9, 0.15, 0.6], 0.22], [[0.35, 0.75, -0.75], 0.2]];

// Shapes and materials, which all figures share.
class Workshop {
  constructor(numbers) {
    const { shapes, view, colours } = facts;
    const shared = ({ mesh, joint, colour, fades, on }) => ({
      joint, on, geometry: this.geometry(numbers, mesh), material: this.material(colour),
      faded: fades ? this.material([...colour.slice(0, 3), FADED]) : null,
    });
    this.hand = shapes.hand.map(shared);
    this.object = shapes.object.map(shared);
    this.obstacles = { object: shapes.obstacles.object.map(shared), palm: shapes.obstacles.palm.map(shared) };
    this.ball = new THREE.SphereGeometry(1, 24, 16);
    this.rod = new THREE.CylinderGeometry(1, 1, 1, 20).rotateX(Math.PI / 2);
    this.arrow = this.arrowGeometry(...view.normal);
    const layer = (colour, name) => [this.material(colour), this.through(colour, SHOWN_THROUGH[name])];
    this.layers = { force: layer([...FORCE_COLOUR, 1], "force") };
    for (const name of ["contact", "normal", "ellipsoid"]) this.layers[name] = layer(colours[name], name);
    this.stripes = facts.rejected.stripes.map(shared);
    this.layers.clash = layer(colours.clash, "clash");
    if (shapes.sticks) [this.bone, this.joint] = shapes.sticks.colours.map((colour) => this.material(colour));
  }

  geometry(numbers, mesh) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(numbers.get(`${mesh}_vertices`).flat(), 3));
    geometry.setAttribute("normal", new THREE.BufferAttribute(numbers.get(`${mesh}_normals`), 3, true));
    geometry.setIndex(new THREE.BufferAttribute(numbers.get(`${mesh}_faces`), 1));
    return geometry;
  }

  material([red, green, blue, opacity]) {
    const clear = opacity < 1;
    const look = { color: new THREE.Color(red, green, blue), specular: 0x3a3a3a, shininess: 55, side: THREE.DoubleSide };
    return new THREE.MeshPhongMaterial({ ...look, opacity, transparent: clear, depthWrite: !clear });
  }

  through([red, green, blue], opacity) {
    const look = { color: new THREE.Color(red, green, blue), opacity, transparent: true, depthTest: false };
    return new THREE.MeshBasicMaterial({ ...look, depthWrite: false });
  }

  // An arrow of length one along z, whose thickness suits an arrow of this length and radius.
  arrowGeometry(length, radius) {
    const neck = 1 - (5 * radius) / length, r = radius / length;
    const outline = [[0, 0], [r, 0], [r, neck], [2.6 * r, neck], [0, 1]].map(([x, y]) => new THREE.Vector2(x, y));
    return new THREE.LatheGeometry(outline, 20).rotateX(Math.PI / 2);
  }
}

// One grasp as it is drawn.
class Figure {
  constructor(workshop, kinematics) {
    this.workshop = workshop;
    this.placements = kinematics.room();
    this.scene = new THREE.Scene();
    // In the palm's frame, which is turned until the plane is level on which the object stands.
    this.palm = this.group(this.scene);
    this.joints = this.placements.map(() => this.group());
    this.object = this.group();
    this.fading = [];
    for (const shape of workshop.hand) this.solid(shape, this.joints[shape.joint]);
    for (const shape of workshop.object) this.solid(shape, this.object);
    this.obstacles = { object: this.group(), palm: this.group() };
    for (const [frame, group] of Object.entries(this.obstacles)) {
      for (const shape of workshop.obstacles[frame]) this.solid(shape, group);
    }
    this.layers = {};
    this.stripes = workshop.stripes.map((shape) => this.solid(shape, this.carrier(shape)));
    this.clash = this.mark("clash", workshop.ball);
    this.contacts = facts.contacts.map(() => this.mark("contact", workshop.ball));
    this.normals = facts.contacts.map(() => this.mark("normal", workshop.arrow));
    this.forces = facts.contacts.map(() => this.mark("force", workshop.arrow));
    this.ellipsoid = this.mark("ellipsoid", workshop.ball);
    this.sticks = facts.shapes.sticks ? this.skeleton(facts.shapes.sticks) : null;
    this.scene.add(new THREE.AmbientLight(0xffffff, 0.42));
    this.lamps = LAMPS.map(([, intensity]) => new THREE.DirectionalLight(0xffffff, intensity));
    this.scene.add(...this.lamps);
  }

  solid(shape, parent) {
    const made = new THREE.Mesh(shape.geometry, shape.material);
    parent.add(made);
    if (shape.faded) this.fading.push([made, shape]);
    return made;
  }

  // What carries one of the shapes that collide.
  carrier({ on, joint }) {
    if (on === "hand") return this.joints[joint];
    if (on === "object") return this.object;
    return this.obstacles[joint ? "object" : "palm"];
  }

  // Shapes that collide stand for the bodies that they belong to.
  showClash(on) {
    const { stripes, point } = facts.rejected;
    this.clashes = on && stripes.length > 0;
    for (const mesh of this.stripes) mesh.visible = this.clashes;
    for (const [mesh, { material, faded }] of this.fading) mesh.material = this.clashes ? faded : material;
    this.clash.visible = Boolean(this.clashes && point);
    if (this.clash.visible) {
      const radius = facts.view.contact_radius;
      this.clash.matrix.makeScale(radius, radius, radius).setPosition(...point);
    }
  }

  group(parent = this.palm) {
    const made = new THREE.Group();
    made.matrixAutoUpdate = false;
    parent.add(made);
    return made;
  }

  // Something drawn on top: itself, and what of it shows through.
  mark(name, geometry) {
    const made = this.group((this.layers[name] ||= this.group()));
    this.workshop.layers[name].forEach((material, i) => {
      const mesh = new THREE.Mesh(geometry, material);
      mesh.renderOrder = i ? 2 : 1;
      made.add(mesh);
    });
    return made;
  }

  // Bones of a hand without meshes: rods, their rounded ends, and balls at the joints.
  skeleton({ bones, joints }) {
    const { workshop } = this;
    const mesh = (geometry, material) => {
      const made = new THREE.Mesh(geometry, material);
      made.matrixAutoUpdate = false;
      this.palm.add(made);
      return made;
    };
    return {
      rods: bones.map(() => mesh(workshop.rod, workshop.bone)),
      tips: bones.map(() => mesh(workshop.ball, workshop.bone)),
      balls: joints.map(() => mesh(workshop.ball, workshop.joint)),
    };
  }

  show(read) {
    this.read = read;
    this.placements.forEach((T, i) => setMatrix(this.joints[i], T));
    if (facts.view.up) {
      const up = new THREE.Vector3(...rotated(read.object, facts.view.up));
      this.palm.matrix.makeRotationFromQuaternion(new THREE.Quaternion().setFromUnitVectors(up, new THREE.Vector3(0, 0, 1)));
    }
    setMatrix(this.object, read.object);
    setMatrix(this.obstacles.object, read.object);
    const { contact_radius: radius, normal: [length] } = facts.view;
    const largest = Math.max(...read.contacts.map(({ force }) => Math.hypot(...force)));
    read.contacts.forEach(({ point, normal, force }, i) => {
      this.contacts[i].matrix.makeScale(radius, radius, radius).setPosition(...point);
      along(this.normals[i].matrix, point, normal, length);
      const strength = Math.hypot(...force);
      this.forces[i].visible = strength > 0;
      if (!(strength > 0)) return;
      const size = (1.1 * length * strength) / largest, direction = force.map((c) => c / strength);
      along(this.forces[i].matrix, point.map((c, k) => c - size * direction[k]), direction, size);
    });
    this.placeEllipsoid(read);
    if (this.sticks) this.placeSticks(facts.shapes.sticks);
  }

  placeEllipsoid({ ellipsoid: { axes, lengths }, object }) {
    this.ellipsoid.visible = lengths[0] > 0;
    if (!this.ellipsoid.visible) return;
    const [long, thin] = facts.view.ellipsoid;
    const [x, y] = axes.map((axis) => new THREE.Vector3(...axis).normalize());
    const z = new THREE.Vector3().crossVectors(x, y);
    [x, y, z].forEach((axis, c) => axis.multiplyScalar(Math.max((long * lengths[c]) / lengths[0], thin)));
    this.ellipsoid.matrix.makeBasis(x, y, z).setPosition(object[3], object[7], object[11]);
  }

  placeSticks({ bones, joints, radii: [thin, thick] }) {
    const origin = (joint) => { const T = this.placements[joint]; return [T[3], T[7], T[11]]; };
    bones.forEach(({ a, b, at }, i) => {
      const from = origin(a), to = transformed(this.placements[b], at);
      const step = to.map((c, k) => c - from[k]), length = Math.hypot(...step);
      this.sticks.rods[i].visible = length > 1e-9;
      const direction = length > 1e-9 ? step.map((c) => c / length) : [0, 0, 1];
      along(this.sticks.rods[i].matrix, from.map((c, k) => c + step[k] / 2), direction, length || 1, thin);
      this.sticks.tips[i].matrix.makeScale(thin, thin, thin).setPosition(...to);
    });
    joints.forEach((joint, i) => this.sticks.balls[i].matrix.makeScale(thick, thick, thick).setPosition(...origin(joint)));
  }
}

function setMatrix(object, T) {
  object.matrix.set(T[0], T[1], T[2], T[3], T[4], T[5], T[6], T[7], T[8], T[9], T[10], T[11], 0, 0, 0, 1);
}

// The matrix that takes z to a direction, stretched by a length along it and by a width across.
function along(matrix, origin, direction, length, width = length) {
  const z = new THREE.Vector3(...direction);
  const least = [0, 1, 2].reduce((a, b) => (Math.abs(direction[b]) < Math.abs(direction[a]) ? b : a));
  const x = new THREE.Vector3().setComponent(least, 1).cross(z).normalize();
  const y = new THREE.Vector3().crossVectors(z, x);
  return matrix.makeBasis(x.multiplyScalar(width), y.multiplyScalar(width), z.multiplyScalar(length)).setPosition(...origin);
}

class HandView {
  constructor(numbers, selection, grasps) {
    Object.assign(this, { selection, grasps });
    this.canvas = byId("hand-canvas");
    this.captions = byId("captions");
    const workshop = new Workshop(numbers);
    this.figures = [0, 1].map(() => new Figure(workshop, grasps.kinematics));
    this.stage = new Stage(this.canvas, (width, height) => this.draw(width, height));
    this.orbit = new Orbit(this.canvas, { changed: () => this.stage.request() });
    this.orbit.look(new THREE.Vector3(...facts.view.direction));
    this.panes = [];
    this.visible = { contact: true, normal: true, force: false, ellipsoid: true, object: true, obstacles: true, clash: true };
    selection.on("grasps", () => this.update());
    selection.on("view", () => this.update());
  }

  // Show the grasps that are selected; what has been read stays until another one takes its place.
  update() {
    const { shown } = this.selection;
    shown.forEach((grasp, i) => {
      if (this.panes[i] === grasp) return;
      this.figures[i].show(this.grasps.read(grasp, this.figures[i].placements));
    });
    this.panes = [...shown];
    this.caption();
    this.stage.request();
  }

  reads() {
    return this.panes.map((_, i) => this.figures[i].read);
  }

  layers(changes) {
    Object.assign(this.visible, changes);
    this.stage.request();
  }

  // Side by side where there is room, else one above the other.
  boxes(width, height) {
    const n = this.panes.length, beside = width > 1.1 * height || width > 340;
    return this.panes.map((_, i) =>
      beside ? [(i * width) / n, 0, width / n, height] : [0, height - ((i + 1) * height) / n, width, height / n]);
  }

  draw(width, height) {
    const { renderer } = this.stage, boxes = this.boxes(width, height);
    renderer.setScissorTest(true);
    renderer.setScissor(0, 0, width, height);
    renderer.setClearAlpha(0);
    renderer.clear();
    this.fit(boxes[0]);
    boxes.forEach(([x, y, w, h], i) => {
      const figure = this.figures[i];
      figure.showClash(this.visible.clash && this.panes[i] === facts.rejected.chart);
      for (const [name, layer] of Object.entries(figure.layers)) {
        layer.visible = this.visible[name] && !(figure.clashes && HIDDEN_BY_A_CLASH.includes(name));
      }
      figure.object.visible = this.visible.object;
      for (const group of Object.values(figure.obstacles)) group.visible = this.visible.obstacles;
      this.orbit.update(w / h);
      this.light(figure);
      renderer.setViewport(x, y, w, h);
      renderer.setScissor(x, y, w, h);
      this.orbit.camera.setViewOffset(w, h, 0, this.room / 2, w, h);
      renderer.render(figure.scene, this.orbit.camera);
      this.orbit.camera.clearViewOffset();
    });
  }

  // Stand where hand and object are above the captions, whose height counts when the panes change their shape.
  fit([, , width, height]) {
    const shape = `${width} ${height}`;
    if (shape !== this.shape) {
      const tallest = Math.max(...[...this.captions.children].map((caption) => caption.offsetHeight));
      Object.assign(this, { shape, room: Math.min(tallest, height / 3) });
    }
    const { room } = this;
    this.orbit.fit(facts.view.points, width / (height - room), (1.04 * height) / (height - room));
  }

  light(figure) {
    const axes = [0, 1, 2].map(() => new THREE.Vector3());
    this.orbit.camera.matrixWorld.extractBasis(...axes);
    LAMPS.forEach(([place], i) => {
      const at = figure.lamps[i].position.set(0, 0, 0);
      axes.forEach((axis, c) => at.addScaledVector(axis, place[c]));
    });
  }

  caption() {
    const { selection } = this, index = facts.indices[selection.index], n = this.panes.length;
    const captions = this.panes.map((grasp, i) => {
      const pinned = selection.pins.includes(grasp), [title, rest] = selection.title(grasp);
      const button = element("button", { type: "button", textContent: pinned ? "unpin" : "pin" });
      button.addEventListener("click", () => selection.pin(grasp));
      const badge = pinned ? [element("span", { className: "badge", textContent: "AB"[i] })] : [];
      const value = `${index.label} ${short(selection.values[grasp])}`;
      return element("div", { className: "caption" },
        ...badge, element("b", { textContent: title }), rest ? ` ${rest}` : "", button, element("br"),
        element("span", { className: "value", textContent: value }), element("br"), motionText(this.figures[i].read),
        ...(grasp === facts.rejected.chart ? facts.rejected.lines : []).flatMap((line) =>
          [element("br"), element("span", { className: "no", textContent: `\u2717 ${line}` })]));
    });
    captions.forEach((caption, i) => {
      Object.assign(caption.style, { left: `${(100 * i) / n}%`, width: `${100 / n}%` });
    });
    this.captions.replaceChildren(...captions);
  }
}

// How far the object moves when the joints turn by one radian (root of the sum of squares).
function motionText({ ellipsoid: { lengths } }) {
  const axes = lengths.slice(0, facts.translations).map((length) => 1000 * length);
  if (!(Math.max(...axes) > 1e-6)) return "the joints do not move the object";
  return `object moves ${axes.map((axis) => (axis > 1e-6 ? short(axis, 3) : "0")).join(", ")} mm per rad`;
}
