"use strict";
// Wakes of a farm: translucent rings that drift with them, as wide as they are and coloured by deficit.
const DEFICIT_COLOURS = ["#f7e3a1", "#e8a33d", "#b3261e", "#5b0f3c"];
class WakeRings {
  /** ``wakes`` of a scene: number of them and of stations along each, m between these, m/s of the drift, largest deficit. */
  constructor(scene, centre) {
    Object.assign(this, scene.about.wakes, { centre });
    this.track = new Track(scene, "wakes", scene.about.steps.wakes);
    this.values = new Float32Array(this.track.size);
    this.table = DEFICIT_COLOURS.map((name) => new THREE.Color(name));
    const paint = new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.4, side: THREE.DoubleSide, depthWrite: false, toneMapped: false });
    this.mesh = new THREE.InstancedMesh(new THREE.CylinderGeometry(1, 1, 1, 64, 1, true), paint, this.count * (this.stations - 1));
    this.mesh.frustumCulled = false;
  }

  /** Ring j is on its way from station j to the next, where the next one began it. */
  update(t) {
    const { values: v, table, mesh } = this, w = ((this.drift * t) / this.spacing) % 1, last = table.length - 1;
    this.track.at(t, v);
    const from = new THREE.Vector3(), way = new THREE.Vector3(), up = new THREE.Vector3(0, 1, 0), turn = new THREE.Quaternion();
    const size = new THREE.Vector3(), matrix = new THREE.Matrix4(), colour = new THREE.Color();
    for (let k = 0, ring = 0; k < this.count; k++) for (let j = 0; j < this.stations - 1; j++, ring++) {
      const a = 5 * (k * this.stations + j), at = (i) => (1 - w) * v[a + i] + w * v[a + 5 + i];
      const share = Math.min(Math.max(at(3) / this.largest, 0), 1), x = share * last, i = Math.min(Math.floor(x), last - 1);
      way.set(v[a + 5] - v[a], v[a + 6] - v[a + 1], v[a + 7] - v[a + 2]);
      turn.setFromUnitVectors(up, way.normalize());
      const r = share > 0.02 ? at(4) : 0;
      matrix.compose(from.set(at(0) - this.centre[0], at(1) - this.centre[1], at(2)), turn, size.set(r, r && 0.2 * this.spacing, r));
      mesh.setMatrixAt(ring, matrix);
      mesh.setColorAt(ring, colour.lerpColors(table[i], table[i + 1], x - i));
    }
    mesh.instanceMatrix.needsUpdate = mesh.instanceColor.needsUpdate = true;
  }
}
