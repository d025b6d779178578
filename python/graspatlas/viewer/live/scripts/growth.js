// The atlas while it grows: a point for each chart, asked for a few times a second, only those that are new.

const LOOK_EVERY = 250; // milliseconds

class Growth {
  constructor() {
    this.known = this.epoch = 0;
    this.places = new Float32Array(0);
    this.values = new Float32Array(0);
    this.scene = new THREE.Scene();
    this.stage = new Stage(byId("growth"), (width, height) => this.draw(width, height));
    this.orbit = new Orbit(byId("growth"), { changed: () => this.stage.request() });
    const look = { size: 5 * this.stage.renderer.getPixelRatio(), sizeAttenuation: false, vertexColors: true, map: disc(), alphaTest: 0.5 };
    this.points = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial(look));
    this.points.frustumCulled = false;
    this.scene.add(this.points);
    drawScale(byId("scale-bar"));
    startTheme(() => this.stage.request());
    this.look();
  }

  async look() {
    try {
      const news = await asked(`news?since=${this.known}&epoch=${this.epoch}`);
      if (!("phase" in news)) return location.reload(); // the page of the whole atlas has come
      this.hear(news);
      setTimeout(() => this.look(), LOOK_EVERY);
    } catch (error) {
      byId("growth-text").textContent = error.message;
    }
    document.documentElement.dataset.ready = "yes";
  }

  hear({ phase, n_charts: n, n_open: open, epoch, places, values, index }) {
    byId("growth-text").textContent = n ? `${n} charts, ${open} open: ${phase}` : phase;
    const more = new Float32Array(bytesOf(places).buffer), moreValues = new Float32Array(bytesOf(values).buffer);
    if (epoch !== this.epoch) [this.places, this.values] = [new Float32Array(0), new Float32Array(0)];
    this.epoch = epoch;
    if (!more.length) return;
    this.places = chained(this.places, more);
    this.values = chained(this.values, moreValues);
    this.known = this.places.length / 3;
    this.paint(index);
  }

  paint(index) {
    const known = this.values.filter(Number.isFinite).sort(), colours = new Uint8Array(this.places.length);
    // A few values that are far larger than all others leave the others their colours.
    const low = known[0] ?? 0, high = known[Math.floor(0.98 * (known.length - 1))] ?? 1;
    const share = (value, i) => (known.length ? (value - low) / (high - low || 1) : i / this.known);
    for (let i = 0; i < this.known; i++) viridis(share(this.values[i], i), colours, 3 * i);
    const { geometry } = this.points;
    geometry.setAttribute("position", new THREE.BufferAttribute(this.places, 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3, true));
    byId("scale").hidden = false;
    byId("scale-low").textContent = known.length ? short(low) : "first";
    byId("scale-high").textContent = known.length ? short(high) : "last";
    byId("scale-unit").textContent = known.length ? index : "in the order of growth";
    this.orbit.fitted = 0;
    this.stage.request();
  }

  draw(width, height) {
    if (this.known) this.orbit.fit(this.places, width / height, 1.1);
    this.orbit.update(width / height);
    this.stage.renderer.render(this.scene, this.orbit.camera);
  }
}

window.growth = new Growth(); // for whoever looks from the console
