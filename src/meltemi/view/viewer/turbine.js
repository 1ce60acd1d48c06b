"use strict";
// Bodies of a turbine in three dimensions: tower, nacelle, hub and blades, their loads as colours and arrows.

const AROUND = 40; // points around the tower
const LOAD_COLOURS = ["#dfe6ea", "#f5d88a", "#e08a00", "#b3261e", "#5b0f3c"];

/** Colours between given ones, as a table of 256 entries of three linear components. */
function colourTable(names) {
  const colours = names.map((name) => new THREE.Color(name)), table = new Float32Array(768), mixed = new THREE.Color();
  for (let i = 0; i < 256; i++) {
    const x = (i / 255) * (colours.length - 1), j = Math.min(Math.floor(x), colours.length - 2);
    mixed.lerpColors(colours[j], colours[j + 1], x - j).toArray(table, 3 * i);
  }
  return table;
}
const LOAD_TABLE = colourTable(LOAD_COLOURS);

/** An arrow of unit length along y, about its beginning; its width is a share of its length. */
function arrowGeometry() {
  const profile = [[0, 0], [0.028, 0], [0.028, 0.72], [0.085, 0.72], [0, 1]].map(([x, y]) => new THREE.Vector2(x, y));
  return new THREE.LatheGeometry(profile, 10);
}

/** Many arrows of one colour, set one by one: ``set(i, from, along)``. */
class Arrows {
  constructor(parent, count, colour) {
    this.mesh = new THREE.InstancedMesh(arrowGeometry(), new THREE.MeshStandardMaterial({ color: colour, roughness: 0.6 }), count);
    this.mesh.frustumCulled = false;
    parent.add(this.mesh);
    this.up = new THREE.Vector3(0, 1, 0);
    this.turn = new THREE.Quaternion();
    this.size = new THREE.Vector3();
    this.unit = new THREE.Vector3();
    this.matrix = new THREE.Matrix4();
  }

  set(i, from, along, least = 0) {
    const length = along.length();
    this.turn.setFromUnitVectors(this.up, this.unit.copy(along).divideScalar(Math.max(length, 1e-9)));
    const width = Math.max(length, least);
    this.size.set(width, Math.max(length, 1e-6), width);
    this.mesh.setMatrixAt(i, this.matrix.compose(from, this.turn, this.size));
    this.mesh.instanceMatrix.needsUpdate = true;
  }
}

/** Outline of a square with round corners, by half its side and the radius of the corners. */
function roundedSquare(half, radius) {
  const shape = new THREE.Shape(), inside = half - radius;
  shape.moveTo(-inside, -half);
  for (const [x, y, level] of [[1, -1, true], [1, 1, false], [-1, 1, true], [-1, -1, false]]) {
    const ends = [[x * inside, y * half], [x * half, y * inside]];
    if (!level) ends.reverse(); // the side before this corner is upright
    shape.lineTo(...ends[0]);
    shape.quadraticCurveTo(x * half, y * half, ...ends[1]);
  }
  return shape;
}

class TurbineView {
  /** ``look``: colour of the body, colours of the tips of the blades, opacity. */
  constructor(scene, look) {
    this.scene = scene;
    this.about = scene.about.turbine;
    this.loaded = scene.about.kind === "run";
    this.group = new THREE.Group();
    const clear = look.opacity < 1;
    const paint = (more = {}) => new THREE.MeshStandardMaterial({
      color: look.body, roughness: 0.55, metalness: 0.05, transparent: clear, opacity: look.opacity, ...more,
    });
    this.parts(paint);
    this.towerMesh(paint({ vertexColors: true, color: "#ffffff" }));
    this.base = new THREE.Color(look.body).toArray();
    this.under = this.about.water && new Underwater(this.about, () => paint({ color: "#e2b84a" }));
    if (this.under) this.group.add(this.under.group);
    this.blades = Array.from({ length: this.about.blades }, (_, b) => this.bladeMesh(b, paint({ vertexColors: true, color: "#ffffff", side: THREE.DoubleSide }), look.tips[b]));
    if (this.loaded) this.loads();
    this.R = new Float32Array(9);
  }

  shadows(group) {
    group.traverse((part) => { part.castShadow = part.isMesh && !part.isInstancedMesh && !part.material.transparent; });
  }

  /** Chain of frames: tower top, nacelle, shaft, and for each blade azimuth, cone and pitch. */
  parts(paint) {
    const a = this.about, R = a.rotor_radius, B = a.blades;
    const inner = (parent) => parent.add(new THREE.Group()).children.at(-1);
    this.top = inner(this.group);
    this.nacelle = inner(this.top);
    this.shaft = inner(this.nacelle);
    this.shaft.position.z = a.shaft_height;
    this.shaft.rotation.y = a.tilt;
    this.apex = inner(this.shaft);
    this.apex.position.x = -a.overhang;
    this.rotor = inner(this.apex);
    this.frames = Array.from({ length: B }, (_, b) => {
      const azimuth = inner(this.rotor);
      azimuth.rotation.x = (2 * Math.PI * b) / B;
      const cone = inner(azimuth);
      cone.rotation.y = -a.precone;
      return { cone, pitched: inner(cone) };
    });
    const root = 0.5 * a.root_diameter, side = Math.sign(a.overhang) || 1;
    const hub = new THREE.Mesh(new THREE.SphereGeometry(Math.max(a.hub_radius, 1.15 * root), 40, 28), paint());
    hub.scale.x = 1.2;
    this.rotor.add(hub);
    const height = Math.max(0.068 * R, 2.05 * root), long = Math.max(0.2 * R, 1.7 * Math.abs(a.overhang));
    const shape = roundedSquare(0.5 * height, 0.28 * height);
    const bevel = 0.16 * height;
    const body = new THREE.ExtrudeGeometry(shape, { depth: long - 2 * bevel, bevelEnabled: true, bevelThickness: bevel, bevelSize: -0.06 * height, bevelOffset: 0, bevelSegments: 4, curveSegments: 8 });
    body.translate(0, 0, bevel);
    body.applyMatrix4(new THREE.Matrix4().makeBasis(new THREE.Vector3(0, 1, 0), new THREE.Vector3(0, 0, 1), new THREE.Vector3(1, 0, 0)));
    const housing = new THREE.Mesh(body, paint());
    housing.position.x = side > 0 ? -Math.abs(a.overhang) + 1.1 * Math.max(a.hub_radius, root) : Math.abs(a.overhang) - long - a.hub_radius;
    this.shaft.add(housing);
    const neck = new THREE.CylinderGeometry(0.42 * a.tower_diameter.at(-1), 0.5 * a.tower_diameter.at(-1), a.shaft_height, 40);
    neck.rotateX(Math.PI / 2);
    neck.translate(0, 0, 0.5 * a.shaft_height);
    this.nacelle.add(new THREE.Mesh(neck, paint()));
  }

  towerMesh(material) {
    const a = this.about, L = a.tower_height.length;
    const geometry = new THREE.CylinderGeometry(1, 1, 1, AROUND, L - 1, true);
    geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(geometry.attributes.position.count * 3), 3));
    this.tower = new THREE.Mesh(geometry, material);
    this.tower.frustumCulled = false;
    this.group.add(this.tower);
    const position = geometry.attributes.position, normal = geometry.attributes.normal;
    for (let i = 0, v = 0; i < L; i++) { // from the top down, x to the sides and y up in the library's cylinder
      for (let j = 0; j <= AROUND; j++, v++) normal.setXYZ(v, Math.cos((2 * Math.PI * j) / AROUND), Math.sin((2 * Math.PI * j) / AROUND), 0);
    }
    const index = geometry.index.array;
    for (let i = 0; i < index.length; i += 3) [index[i], index[i + 1]] = [index[i + 1], index[i]];
    this.towerPosition = position;
  }

  bladeMesh(b, material, tip) {
    const { arrays, about } = this.scene, [S, P] = arrays.skin.shape, axis = arrays.axis;
    const at = new Float32Array(S * P * 3 + 3), index = [];
    for (let i = 0; i < S; i++) {
      for (let j = 0; j < P; j++) for (let k = 0; k < 3; k++) at[(i * P + j) * 3 + k] = axis[3 * i + k] + arrays.skin[(i * P + j) * 3 + k];
    }
    for (let i = 0; i < S - 1; i++) {
      for (let j = 0; j < P; j++) {
        const a = i * P + j, c = i * P + ((j + 1) % P);
        index.push(a, c, a + P, c, c + P, a + P);
      }
    }
    const end = S * P;
    for (let j = 0; j < P; j++) index.push((S - 1) * P + j, (S - 1) * P + ((j + 1) % P), end);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(at, 3));
    for (let k = 0; k < 3; k++) at[3 * end + k] = axis[3 * (S - 1) + k];
    geometry.setIndex(index);
    geometry.computeVertexNormals();
    const rest = geometry.attributes.normal.array.slice();
    const paint = new Float32Array(3 * (end + 1)), mark = new THREE.Color(tip).toArray();
    const length = about.sections.at(-1);
    for (let v = 0; v <= end; v++) {
      const s = about.sections[Math.min(Math.floor(v / P), S - 1)];
      paint.set(s > 0.9 * length ? mark : this.base, 3 * v);
    }
    geometry.setAttribute("color", new THREE.BufferAttribute(paint.slice(), 3));
    const mesh = new THREE.Mesh(geometry, material);
    mesh.frustumCulled = false;
    this.frames[b].pitched.add(mesh);
    return { mesh, rest, paint, at: geometry.attributes.position, normal: geometry.attributes.normal, colour: geometry.attributes.color };
  }

  loads() {
    const { scene } = this;
    this.take(scene);
    this.values = { air: new Float32Array(this.air.size), bending: new Float32Array(this.bending.size), tower: new Float32Array(this.towerBending.size) };
    this.nodes = scene.about.air_position.map((s, n) => [s, n]).filter((_, n, all) => n % Math.ceil(all.length / 14) === 0 || n === all.length - 1);
    this.airArrows = this.frames.map((frame) => new Arrows(frame.cone, this.nodes.length, "#1f8fc9"));
    this.momentArrows = [...this.frames.map((frame) => new Arrows(frame.pitched, 1, "#a83277")), new Arrows(this.group, 1, "#a83277")];
  }

  /** Loads of a scene of the same turbine. */
  take(scene) {
    const { steps } = scene.about;
    this.air = new Track(scene, "air", steps.air);
    this.bending = new Track(scene, "bending", steps.bending);
    this.towerBending = new Track(scene, "tower_bending", steps.tower_bending);
  }

  /** Move everything to a pose, with deflections times ``factor``. */
  update(pose, factor) {
    const a = this.about;
    const rest = a.tower_base + a.tower_length;
    this.top.position.set(factor * pose.top[0], factor * pose.top[1], rest + factor * (pose.top[2] - rest));
    const angle = Math.hypot(...pose.tilt);
    this.top.quaternion.setFromAxisAngle(new THREE.Vector3(...pose.tilt).divideScalar(angle || 1), factor * angle);
    this.nacelle.rotation.z = pose.yaw;
    this.rotor.rotation.x = pose.azimuth;
    this.frames.forEach((frame, b) => { frame.pitched.rotation.z = -pose.pitch[b]; });
    this.moveTower(pose, factor);
    pose.blades.forEach((moved, b) => this.moveBlade(b, moved, factor));
  }

  moveTower(pose, factor) {
    const a = this.about, shape = this.scene.arrays.tower_shape, L = a.tower_height.length, at = this.towerPosition;
    for (let i = 0, v = 0; i < L; i++) {
      const l = L - 1 - i, r = 0.5 * a.tower_diameter[l];
      let x = 0, y = 0;
      pose.tower.forEach((q, m) => {
        x += factor * q * shape[(m * L + l) * 6];
        y += factor * q * shape[(m * L + l) * 6 + 1];
      });
      for (let j = 0; j <= AROUND; j++, v++) {
        const psi = (2 * Math.PI * j) / AROUND;
        at.setXYZ(v, x + r * Math.cos(psi), y + r * Math.sin(psi), a.tower_base + a.tower_height[l]);
      }
    }
    at.needsUpdate = true;
    const base = [0, 1, 2, 3, 4, 5].map((k) => pose.tower.reduce((sum, q, m) => sum + factor * q * shape[m * L * 6 + k], 0));
    this.under?.update(base);
  }

  moveBlade(b, moved, factor) {
    const { arrays } = this.scene, [S, P] = arrays.skin.shape, { skin, axis } = arrays, { at, normal, rest } = this.blades[b], R = this.R;
    const x = at.array, n = normal.array;
    for (let i = 0; i < S; i++) {
      const m = 6 * i;
      rotationMatrix(factor * moved[m + 3], factor * moved[m + 4], factor * moved[m + 5], R);
      const px = axis[3 * i] + factor * moved[m], py = axis[3 * i + 1] + factor * moved[m + 1], pz = axis[3 * i + 2] + factor * moved[m + 2];
      for (let j = 0, v = 3 * i * P; j < P; j++, v += 3) {
        const a = skin[v], c = skin[v + 1], d = skin[v + 2], e = rest[v], f = rest[v + 1], g = rest[v + 2];
        x[v] = px + R[0] * a + R[1] * c + R[2] * d;
        x[v + 1] = py + R[3] * a + R[4] * c + R[5] * d;
        x[v + 2] = pz + R[6] * a + R[7] * c + R[8] * d;
        n[v] = R[0] * e + R[1] * f + R[2] * g;
        n[v + 1] = R[3] * e + R[4] * f + R[5] * g;
        n[v + 2] = R[6] * e + R[7] * f + R[8] * g;
      }
      if (i === S - 1) x.set([px, py, pz], 3 * S * P);
    }
    at.needsUpdate = normal.needsUpdate = true;
  }

  /** Bending moments as colours, distributed loads of the air as arrows, moments at roots and base as arrows. */
  showLoads(t, mode, pose, factor) {
    const colours = mode === "colours" && this.loaded, arrows = mode === "arrows" && this.loaded;
    if (this.loaded) [...this.airArrows, ...this.momentArrows].forEach((each) => { each.mesh.visible = arrows; });
    this.colourTower(t, colours);
    this.blades.forEach((_, b) => this.colourBlade(t, b, colours));
    if (arrows) this.placeArrows(t, pose, factor);
  }

  colourTower(t, shown) {
    if (!shown && this.plain) return;
    this.plain = !shown;
    const a = this.about, L = a.tower_height.length, colour = this.tower.geometry.attributes.color, m = this.values?.tower;
    if (shown) this.towerBending.at(t, m);
    const cuts = this.scene.about.tower_cuts, sizes = shown && cuts.map((_, i) => Math.hypot(m[2 * i], m[2 * i + 1]));
    for (let i = 0, v = 0; i < L; i++) {
      const share = shown && interpolate(cuts, sizes, a.tower_height[L - 1 - i]) / this.scene.about.largest.tower_bending;
      const entry = 3 * Math.round(255 * Math.min(share, 1));
      for (let j = 0; j <= AROUND; j++, v++) {
        if (shown) colour.setXYZ(v, LOAD_TABLE[entry], LOAD_TABLE[entry + 1], LOAD_TABLE[entry + 2]);
        else colour.setXYZ(v, ...this.base);
      }
    }
    colour.needsUpdate = true;
  }

  colourBlade(t, b, shown) {
    const blade = this.blades[b], { about, arrays } = this.scene, [S, P] = arrays.skin.shape;
    if (!shown) {
      if (blade.coloured) blade.colour.array.set(blade.paint);
      blade.colour.needsUpdate ||= blade.coloured;
      blade.coloured = false;
      return;
    }
    blade.coloured = blade.colour.needsUpdate = true;
    const m = this.bending.at(t, this.values.bending, b), cuts = [...about.cuts, about.sections.at(-1)];
    const sizes = [...about.cuts.map((_, i) => Math.hypot(m[2 * i], m[2 * i + 1])), 0];
    for (let i = 0; i < S; i++) {
      const entry = 3 * Math.round(255 * Math.min(interpolate(cuts, sizes, about.sections[i]) / about.largest.bending, 1));
      for (let v = 3 * i * P; v < 3 * (i + 1) * P; v += 3) for (let k = 0; k < 3; k++) blade.colour.array[v + k] = LOAD_TABLE[entry + k];
    }
  }

  placeArrows(t, pose, factor) {
    const { about, arrays } = this.scene, R = this.about.rotor_radius, from = new THREE.Vector3(), along = new THREE.Vector3();
    const scale = (0.5 * R) / about.largest.air;
    this.airArrows.forEach((arrows, b) => {
      const load = this.air.at(t, this.values.air, b), c = Math.cos(pose.pitch[b]), s = Math.sin(pose.pitch[b]);
      this.nodes.forEach(([place, n], i) => {
        const [x, y, z] = [0, 1, 2].map((k) => interpolate(about.sections, arrays.axis, place, 3, k) + factor * interpolate(about.sections, pose.blades[b], place, 6, k));
        from.set(c * x + s * y, c * y - s * x, z); // from pitched to coned axes
        arrows.set(i, from, along.set(scale * load[2 * n], -scale * load[2 * n + 1], 0), 0.05 * R);
      });
      const m = this.bending.at(t, this.values.bending, b), size = (0.6 * R) / about.largest.bending;
      const root = [0, 1, 2].map((k) => arrays.axis[k]);
      this.momentArrows[b].set(0, from.set(...root), along.set(size * m[1], -size * m[0], 0), 0.12 * R);
    });
    const m = this.towerBending.at(t, this.values.tower), size = (0.7 * R) / about.largest.tower_bending;
    this.momentArrows.at(-1).set(0, from.set(0, 0, this.about.tower_base + 0.03 * R), along.set(size * m[1], -size * m[0], 0), 0.2 * R);
  }

  /** Positions of the blade tips' axis [m], inertial axes. */
  tips() {
    this.group.updateMatrixWorld(true);
    return this.blades.map(({ mesh, at }) => new THREE.Vector3().fromBufferAttribute(at, at.count - 1).applyMatrix4(mesh.matrixWorld).toArray());
  }
}
