// Grasps that have come since the page was made: drawn as points on top of the atlas, in its colours.

const NEAR = 8; // how near to one must be pointed [pixels]

class AddedPoints {
  constructor(atlas, selection) {
    Object.assign(this, { atlas, selection, first: selection.count });
    const pixels = 5 * atlas.stage.renderer.getPixelRatio();
    const look = { size: pixels, sizeAttenuation: false, vertexColors: true, map: disc(), alphaTest: 0.5, depthTest: false };
    this.points = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial(look));
    this.points.renderOrder = 2;
    this.points.frustumCulled = false;
    atlas.scene.add(this.points);
    atlas.added = this;
  }

  // Colours, and the places of those that the atlas has a place for.
  paint() {
    const { selection, atlas: { centers } } = this, scale = selection.scaled(), grey = rgbOf(pageColour("refused"));
    this.shown = [];
    for (let i = this.first; i < selection.count; i++)
      if (!Number.isNaN(centers[3 * i]) && (selection.allows(i) || !this.atlas.hidden)) this.shown.push(i);
    const places = new Float32Array(3 * this.shown.length), colours = new Uint8Array(3 * this.shown.length);
    this.shown.forEach((i, k) => {
      places.set(centers.subarray(3 * i, 3 * i + 3), 3 * k);
      if (selection.allows(i)) viridis(scale(selection.values[i]), colours, 3 * k);
      else colours.set(grey, 3 * k);
    });
    const { geometry } = this.points;
    geometry.setAttribute("position", new THREE.BufferAttribute(places, 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3, true));
    this.points.visible = this.shown.length > 0;
    this.atlas.stage.request();
  }

  // The one nearest to a pixel, or -1.
  pick(x, y, width, height) {
    const place = new THREE.Vector3();
    let found = -1, least = NEAR;
    for (const i of this.shown || []) {
      const at = this.atlas.project(place.fromArray(this.atlas.centers, 3 * i), width, height);
      const far = Math.hypot(at.x - x, at.y - y);
      if (far < least) [found, least] = [i, far];
    }
    return found;
  }
}
