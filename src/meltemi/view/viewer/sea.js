"use strict";
// Water around a turbine: the moving surface, an elevation along the waves, and what stands or floats in it.
const CELLS = 160; // along each side of the surface
class SeaView {
  constructor(scene, size) {
    const { reach, level, direction } = scene.about.turbine.water;
    this.half = reach || 6 * size;
    this.mesh = new THREE.Mesh(new THREE.PlaneGeometry(2 * this.half, 2 * this.half, CELLS, CELLS),
      new THREE.MeshStandardMaterial({ color: "#2f6f8f", roughness: 0.35, metalness: 0.1, transparent: true, opacity: 0.82, side: THREE.DoubleSide }));
    this.mesh.position.z = level || 0;
    this.mesh.rotation.z = direction || 0;
    this.mesh.receiveShadow = true;
    this.take(scene);
    this.line = new Float32Array(this.track ? this.track.size : 0);
  }

  /** The elevation of a scene, or of a piece of it. */
  take(scene) {
    this.track = scene.about.steps.sea && new Track(scene, "sea", scene.about.steps.sea);
  }

  update(t) {
    if (!this.track) return;
    this.track.at(t, this.line);
    const { position, normal } = this.mesh.geometry.attributes, n = this.line.length - 1, row = CELLS + 1;
    for (let i = 0; i < row; i++) {
      const x = (i / CELLS) * n, a = Math.min(Math.floor(x), n - 1), rise = this.line[a + 1] - this.line[a];
      const z = this.line[a] + (x - a) * rise, slope = (rise * n) / (2 * this.half), long = Math.hypot(slope, 1);
      for (let j = 0, v = i; j < row; j++, v += row) position.setZ(v, z) && normal.setXYZ(v, -slope / long, 0, 1 / long);
    }
    position.needsUpdate = normal.needsUpdate = true;
  }
}
/** Pile, or platform with its lines, under a tower. */
class Underwater {
  constructor(about, paint) {
    const { members, lines, floats, utilisation = [] } = about.water, up = new THREE.Vector3(0, 1, 0);
    Object.assign(this, { floats, base: about.tower_base, group: new THREE.Group(), body: new THREE.Group() });
    this.group.add(this.body);
    this.body.position.z = this.base;
    const most = Math.max(...utilisation.map((u) => u ?? 0), 1e-6), sides = members.length > 50 ? 16 : 40;
    members.forEach(([x, y, z, X, Y, Z, d, D], i) => {
      const way = new THREE.Vector3(X - x, Y - y, Z - z), length = way.length();
      const part = new THREE.Mesh(new THREE.CylinderGeometry(0.5 * D, 0.5 * d, length, sides), paint());
      if (utilisation[i] != null) part.material.color.set("#ffffff").lerp(new THREE.Color("#882255"), utilisation[i] / most);
      part.quaternion.setFromUnitVectors(up, way.clone().divideScalar(length));
      part.position.set(x, y, z - this.base).addScaledVector(way, 0.5);
      this.body.add(part);
    });
    this.lines = lines.map((points) => {
      const pairs = points.slice(1).flatMap((p, i) => [points[i], p]), geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(pairs.flat()), 3));
      this.group.add(new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: "#33475b" })));
      this.group.children.at(-1).frustumCulled = false;
      return { pairs, count: points.length - 1, at: geometry.attributes.position };
    });
  }

  /** Move with the base of the tower: displacement and small rotations; a line's points follow in proportion. */
  update(moved) {
    if (!this.floats) return;
    const turn = new THREE.Vector3(...moved.slice(3)), angle = turn.length(), end = new THREE.Vector3();
    this.body.position.set(moved[0], moved[1], this.base + moved[2]);
    this.body.quaternion.setFromAxisAngle(turn.divideScalar(angle || 1), angle);
    for (const { pairs, count, at } of this.lines) {
      const [x, y, z] = pairs[0];
      end.set(x, y, z - this.base).applyQuaternion(this.body.quaternion).add(this.body.position);
      pairs.forEach((p, i) => {
        const share = 1 - Math.ceil(i / 2) / count;
        at.setXYZ(i, p[0] + share * (end.x - x), p[1] + share * (end.y - y), p[2] + share * (end.z - z));
      });
      at.needsUpdate = true;
    }
  }
}
