// A camera that is moved by mouse, pen and fingers: drag to turn, two fingers or the right button to shift, wheel or
// pinch to come nearer. A tap is told to whoever listens.

const TAP = 6; // what a finger may move by while it taps [pixels]

class Orbit {
  // `tapped(x, y, event)` and `hovered(x, y)` get places on the canvas [pixels]; `changed()` when the camera has moved.
  constructor(canvas, { changed, tapped = () => {}, hovered = () => {}, left = () => {}, flat = false }) {
    Object.assign(this, { canvas, changed, tapped, hovered, flat });
    this.camera = new THREE.PerspectiveCamera(24, 1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.target = new THREE.Vector3(); // the middle of what is to be seen
    this.pan = new THREE.Vector3(); // and how far the user has shifted it
    this.distance = 1;
    this.zoom = 1;
    this.fitted = 0; // the shape of the picture that the camera was placed for
    [this.azimuth, this.elevation] = [0.6, 0.5];
    this.pointers = new Map();
    this.travelled = 0;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => this.up(event));
    canvas.addEventListener("pointerleave", () => left());
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
  }

  look({ x, y, z }) {
    this.azimuth = Math.atan2(y, x);
    this.elevation = Math.atan2(z, Math.hypot(x, y));
  }

  // Place the camera; its picture has this width over height.
  update(aspect) {
    const { camera } = this, target = this.target.clone().add(this.pan);
    const reach = this.distance / this.zoom;
    const cosine = Math.cos(this.elevation);
    camera.aspect = aspect;
    camera.position.set(cosine * Math.cos(this.azimuth), cosine * Math.sin(this.azimuth), Math.sin(this.elevation));
    camera.position.multiplyScalar(reach).add(target);
    camera.near = reach / 50;
    camera.far = reach * 20;
    camera.lookAt(target);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    this.reach = reach;
  }

  // Forget what the user has done.
  reset() {
    this.zoom = 1;
    this.pan.set(0, 0, 0);
    this.fitted = 0;
  }

  // Stand where points [x, y, z, ...] are all in sight, when the picture has another shape than before.
  fit(points, aspect, margin = 1.06) {
    if (Math.abs(aspect / this.fitted - 1) < 0.01) return;
    this.fitted = aspect;
    const { zoom } = this, pan = this.pan.clone();
    this.reset();
    this.fitted = aspect;
    const tangent = Math.tan((this.camera.fov * Math.PI) / 360);
    this.target.set(0, 0, 0);
    this.distance = 1;
    for (let round = 0; round < 12; round++) {
      this.update(aspect);
      const right = new THREE.Vector3(), up = new THREE.Vector3(), back = new THREE.Vector3(), p = new THREE.Vector3();
      this.camera.matrixWorld.extractBasis(right, up, back);
      const box = new THREE.Box2();
      let distance = 0;
      for (let i = 0; i < points.length; i += 3) {
        p.set(points[i], points[i + 1], points[i + 2]).sub(this.target);
        box.expandByPoint(new THREE.Vector2(p.dot(right), p.dot(up)));
        const needed = Math.max(Math.abs(p.dot(right)) / aspect, Math.abs(p.dot(up))) / tangent;
        distance = Math.max(distance, needed * margin + p.dot(back));
      }
      const middle = box.getCenter(new THREE.Vector2());
      this.target.addScaledVector(right, middle.x).addScaledVector(up, middle.y);
      this.distance = distance || 1;
    }
    this.zoom = zoom;
    this.pan.copy(pan);
  }

  place(event) {
    const box = this.canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    if (!this.pointers.size) this.travelled = 0;
    this.pointers.set(event.pointerId, { ...this.place(event), shifts: event.button === 2 || event.shiftKey });
    if (this.pointers.size > 1) this.travelled = Infinity;
  }

  move(event) {
    const now = this.place(event), before = this.pointers.get(event.pointerId);
    if (!before) return this.hovered(now.x, now.y);
    const dx = now.x - before.x, dy = now.y - before.y;
    this.travelled += Math.hypot(dx, dy);
    const others = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
    if (others.length) {
      const [other] = others;
      const apart = (place) => Math.max(Math.hypot(place.x - other.x, place.y - other.y), 1);
      this.nearer(apart(now) / apart(before));
      this.shift(dx / 2, dy / 2);
    } else if (this.travelled >= TAP) {
      if (before.shifts || this.flat) this.shift(dx, dy);
      else this.turn(dx, dy);
    }
    this.pointers.set(event.pointerId, { ...before, ...now });
  }

  up(event) {
    const { x, y } = this.place(event);
    const known = this.pointers.delete(event.pointerId);
    if (known && event.type === "pointerup" && this.travelled < TAP && event.button === 0) this.tapped(x, y, event);
  }

  wheel(event) {
    event.preventDefault();
    this.nearer(Math.exp(-0.0015 * event.deltaY * (event.deltaMode ? 20 : 1)));
  }

  turn(dx, dy) {
    this.azimuth -= 0.008 * dx;
    this.elevation = Math.min(Math.max(this.elevation + 0.008 * dy, -1.57), 1.57);
    this.changed();
  }

  shift(dx, dy) {
    const pixel = (2 * this.reach * Math.tan((this.camera.fov * Math.PI) / 360)) / this.canvas.clientHeight;
    const right = new THREE.Vector3(), up = new THREE.Vector3();
    this.camera.matrixWorld.extractBasis(right, up, new THREE.Vector3());
    this.pan.addScaledVector(right, -dx * pixel).addScaledVector(up, dy * pixel);
    this.changed();
  }

  nearer(factor) {
    this.zoom = Math.min(Math.max(this.zoom * factor, 0.2), 40);
    this.changed();
  }
}

// A WebGL renderer that draws when something has changed, once a frame.
class Stage {
  constructor(canvas, draw) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.draw = draw;
    this.waiting = false;
    this.frames = 0;
    new ResizeObserver(() => this.request()).observe(canvas);
  }

  request() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      const { clientWidth: width, clientHeight: height } = this.canvas;
      if (!width || !height) return;
      const size = this.renderer.getSize(new THREE.Vector2());
      if (size.x !== width || size.y !== height) this.renderer.setSize(width, height, false);
      const started = performance.now();
      this.draw(width, height);
      this.milliseconds = performance.now() - started; // script time of the last frame
      this.frames++;
    });
  }
}
