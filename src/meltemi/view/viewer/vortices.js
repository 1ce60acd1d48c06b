"use strict";
// Vortices of a wake: tubes along lines behind the blades, red those of the tips, blue those of the roots, thick where they are strong.
const VORTEX_COLOURS = ["#1f5fae", "#8fb7d9", "#f0ece6", "#ef8a62", "#b2182b"], BETWEEN = 3, AROUND_VORTEX = 5;
class VortexView {
  /** ``vortices`` of a scene: blades, lines of a blade, points of a line, largest strength [m^2/s], begin and step [s] of the frames. */
  constructor(scene) {
    Object.assign(this, scene.about.vortices);
    this.track = new Track(scene, "vortices", this.step);
    this.values = new Float32Array(this.track.size);
    this.rings = (this.points - 1) * BETWEEN + 1;
    this.width = 0.012 * scene.about.turbine.rotor_radius;
    this.table = colourTable(VORTEX_COLOURS);
    const tubes = this.blades * this.lines, count = tubes * this.rings * AROUND_VORTEX, index = [];
    for (let k = 0; k < tubes; k++) for (let i = 0; i < this.rings - 1; i++) for (let j = 0; j < AROUND_VORTEX; j++) {
      const at = (k * this.rings + i) * AROUND_VORTEX, a = at + j, b = at + ((j + 1) % AROUND_VORTEX);
      index.push(a, b, a + AROUND_VORTEX, b, b + AROUND_VORTEX, a + AROUND_VORTEX);
    }
    const geometry = new THREE.BufferGeometry(), array = () => new THREE.BufferAttribute(new Float32Array(3 * count), 3);
    for (const name of ["position", "normal", "color"]) geometry.setAttribute(name, array());
    geometry.setIndex(index);
    this.mesh = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.5 }));
    this.mesh.frustumCulled = false;
  }

  update(t) {
    const { position, normal, color } = this.mesh.geometry.attributes;
    this.between(t - this.begin);
    for (let k = 0, v = 0; k < this.blades * this.lines; k++) v = this.tube(4 * k * this.points, v, position.array, normal.array, color.array);
    position.needsUpdate = normal.needsUpdate = color.needsUpdate = true;
  }

  /** Values at a time: by Catmull and Rom between the frames, as the vortices turn with the rotor. */
  between(t) {
    const { rows, size, amplitude, scale, mean } = this.track, [i, j, w] = place(t, this.step, rows);
    const [a, b, c, d] = [Math.max(i - 1, 0), i, j, Math.min(j + 1, rows - 1)].map((row) => row * size);
    const [A, B, C, D] = [w * (w * (2 - w) - 1), w * w * (3 * w - 5) + 2, w * (w * (4 - 3 * w) + 1), w * w * (w - 1)].map((x) => 0.5 * x);
    for (let k = 0; k < size; k++) this.values[k] = mean[k] + scale[k] * (A * amplitude[a + k] + B * amplitude[b + k] + C * amplitude[c + k] + D * amplitude[d + k]);
  }

  /** Rings of a line whose values begin at ``first``, from vertex component ``v`` on: by Catmull and Rom between its points. */
  tube(first, v, at, normal, colour) {
    const { values: f, points, rings, table } = this, p = [0, 0, 0, 0], d = [0, 0, 0];
    for (let i = 0; i < rings; i++) {
      const j = Math.min(Math.floor(i / BETWEEN), points - 2), s = i / BETWEEN - j;
      const [A, B, C, D] = [Math.max(j - 1, 0), j, j + 1, Math.min(j + 2, points - 1)].map((n) => first + 4 * n);
      for (let k = 0; k < 4; k++) {
        const [a, b, c, e] = [f[A + k], f[B + k], f[C + k], f[D + k]];
        p[k] = b + 0.5 * s * (c - a + s * (2 * a - 5 * b + 4 * c - e + s * (3 * (b - c) + e - a)));
        if (k < 3) d[k] = c - a + s * (2 * (2 * a - 5 * b + 4 * c - e) + 3 * s * (3 * (b - c) + e - a));
      }
      const long = Math.hypot(...d) || 1, [x, y, z] = d.map((value) => value / long), flat = Math.hypot(y, z) || 1;
      const n = [0, -z / flat, y / flat], m = [y * n[2] - z * n[1], -x * n[2], x * n[1]]; // across the tube, n also across x
      const strength = Math.min(Math.max(p[3] / this.largest, -1), 1), shade = 3 * Math.round(127.5 * (1 + strength));
      const r = this.width * Math.sqrt(Math.abs(strength)) * (1 - (0.6 * i) / rings) * Math.min(1, (10 * (rings - 1 - i)) / rings); // it ends in a point
      for (let q = 0; q < AROUND_VORTEX; q++) {
        const c = Math.cos((2 * Math.PI * q) / AROUND_VORTEX), e = Math.sin((2 * Math.PI * q) / AROUND_VORTEX);
        for (let k = 0; k < 3; k++, v++) {
          normal[v] = c * n[k] + e * m[k];
          at[v] = p[k] + r * normal[v];
          colour[v] = table[shade + k];
        }
      }
    }
    return v;
  }
}
