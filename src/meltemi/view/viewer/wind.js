"use strict";
// Wind as a coloured section with arrows, at the rotor or travelling through it with the mean wind (frozen turbulence).

const WIND_COLOURS = ["#1b4f9c", "#4aa3d8", "#eef3ee", "#f2b04a", "#b3400e"];

class WindView {
  constructor(scene) {
    const { about, arrays } = scene, w = (this.where = about.wind);
    this.n = w.points;
    this.group = new THREE.Group();
    this.take(scene);
    const n = this.n, count = n * n, spread = Math.max(this.largest(0.005) * this.scale[0], 0.5);
    this.range = [Math.max(w.speed - spread, 0), w.speed + spread];
    this.now = new Float32Array(3 * count);
    this.pixels = new Uint8Array(4 * count);
    this.texture = new THREE.DataTexture(this.pixels, n, n, THREE.RGBAFormat);
    this.texture.magFilter = this.texture.minFilter = THREE.LinearFilter;
    this.texture.colorSpace = THREE.SRGBColorSpace;
    const box = about.kind === "wind", half = w.half_width, section = box ? new THREE.PlaneGeometry(2 * half, 2 * w.half_height) : new THREE.CircleGeometry(half, 96);
    const uv = section.attributes.uv;
    for (let i = 0; i < uv.count; i++) uv.setXY(i, 0.5 / n + uv.getX(i) * (1 - 1 / n), 0.5 / n + uv.getY(i) * (1 - 1 / n));
    // its plane is y and z: from -y to y, up
    section.applyMatrix4(new THREE.Matrix4().makeBasis(new THREE.Vector3(0, 1, 0), new THREE.Vector3(0, 0, 1), new THREE.Vector3(1, 0, 0)));
    this.plane = new THREE.Mesh(section, new THREE.MeshBasicMaterial({ map: this.texture, transparent: true, opacity: 0.5, side: THREE.DoubleSide, depthWrite: false, toneMapped: false }));
    this.plane.position.z = w.height;
    this.group.add(this.plane);
    this.shown = Array.from({ length: count }, (_, i) => i).filter((i) => box || Math.hypot((i % n) - (n - 1) / 2, Math.floor(i / n) - (n - 1) / 2) <= (n - 1) / 2 + 0.01);
    this.arrows = new Arrows(this.group, this.shown.length, "#6f7e8a");
    this.table = new Uint8Array(3 * 256);
    const colours = WIND_COLOURS.map((name) => [1, 3, 5].map((k) => parseInt(name.slice(k, k + 2), 16)));
    for (let i = 0; i < 256; i++) {
      const x = (i / 255) * (colours.length - 1), j = Math.min(Math.floor(x), colours.length - 2);
      for (let k = 0; k < 3; k++) this.table[3 * i + k] = (1 - x + j) * colours[j][k] + (x - j) * colours[j + 1][k];
    }
  }

  /** Deviation of the longitudinal wind from its mean, in steps of its 8 bits, that a share of all is above, or below its negative. */
  largest(share) {
    const { value } = this, counts = new Uint32Array(256);
    for (let i = 0; i < value.length; i += 3) counts[value[i] + 128] += 1;
    const most = (share * value.length) / 3, beyond = (at, by) => {
      for (let sum = counts[at]; sum <= most; at += by) sum += counts[at + by];
      return Math.abs(at - 128);
    };
    return Math.max(beyond(255, -1), beyond(0, 1));
  }

  /** Velocities of a scene with the same section. */
  take({ about, arrays }) {
    this.value = arrays["wind.amplitude"];
    this.scale = arrays["wind.scale"];
    this.mean = arrays["wind.mean"];
    this.rows = this.value.shape[0];
    this.step = about.steps.wind;
    Object.assign(this.where, { direction: about.wind.direction, speed: about.wind.speed });
    this.group.rotation.z = -about.wind.direction;
  }

  /** ``mode``: rotor (that is, at the tower's axis), travelling or off. */
  update(t, mode) {
    this.group.visible = mode !== "off";
    if (!this.group.visible) return;
    const { n, where } = this, D = where.diameter, travels = mode === "travelling";
    const way = 2.2 * D, x = travels ? ((((t * where.speed) % way) + way) % way) - 1.3 * D : 0;
    this.plane.position.x = x;
    // the wind at x passes the tower later, or has passed it earlier, by the time of travel
    const [i, j, w] = place(Math.max(t - x / Math.max(where.speed, 1), 0), this.step, this.rows), size = 3 * n * n;
    for (let p = 0; p < size; p++) this.now[p] = this.mean[p % 3] + this.scale[p % 3] * ((1 - w) * this.value[i * size + p] + w * this.value[j * size + p]);
    const fade = travels ? Math.min(1, (x + 1.3 * D) / (0.25 * D), (0.9 * D - x) / (0.25 * D)) : 1;
    this.plane.material.opacity = (where.alone ? 0.65 : 0.5) * fade;
    const [low, high] = this.range, c = Math.cos(where.direction), s = Math.sin(where.direction);
    for (let p = 0; p < n * n; p++) {
      const along = c * this.now[3 * p] - s * this.now[3 * p + 1];
      const entry = 3 * Math.round(255 * Math.min(Math.max((along - low) / (high - low), 0), 1));
      for (let k = 0; k < 3; k++) this.pixels[4 * p + k] = this.table[entry + k];
      this.pixels[4 * p + 3] = 255;
    }
    this.texture.needsUpdate = true;
    const spacing = (2 * where.half_width) / (n - 1), scale = (0.85 * spacing) / Math.max(where.speed, 1), from = new THREE.Vector3(), to = new THREE.Vector3();
    this.shown.forEach((p, k) => {
      const y = ((p % n) - (n - 1) / 2) * spacing, u = c * this.now[3 * p] - s * this.now[3 * p + 1], v = s * this.now[3 * p] + c * this.now[3 * p + 1];
      from.set(x, y, where.heights[Math.floor(p / n)]);
      this.arrows.set(k, from, to.set(u * scale * fade, v * scale * fade, this.now[3 * p + 2] * scale * fade), 0.5 * spacing * fade);
    });
  }
}
