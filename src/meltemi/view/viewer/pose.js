"use strict";
// Poses: where everything is at a time. Frames and signs are those of docs/conventions.md: x downwind, z up.

/** Pose of a run: from its recorded tracks. */
class RunMotion {
  constructor(scene) {
    const { about, arrays } = scene, step = about.steps.motion;
    this.duration = about.duration;
    this.step = step;
    this.azimuth = arrays.azimuth;
    this.body = new Track(scene, "body", step);
    this.tower = new Track(scene, "tower", step);
    this.blade = new Track(scene, "blade", step);
    this.bodies = new Float32Array(this.body.size);
    this.pose = newPose(scene, this.tower.size);
  }

  at(t) {
    const { pose, bodies, azimuth } = this, [i, j, w] = place(t, this.step, azimuth.length);
    this.body.at(t, bodies);
    for (let k = 0; k < 3; k++) {
      pose.top[k] = bodies[k];
      pose.tilt[k] = bodies[3 + k];
    }
    pose.yaw = bodies[6];
    pose.azimuth = (1 - w) * azimuth[i] + w * azimuth[j];
    this.tower.at(t, pose.tower);
    pose.blades.forEach((blade, b) => {
      pose.pitch[b] = bodies[7 + b];
      this.blade.at(t, blade, b);
    });
    return pose;
  }
}

/** Pose of a mode at an operating point: a harmonic motion about the steady shape. */
class ModeMotion {
  constructor(scene) {
    this.scene = scene;
    this.duration = Infinity;
    this.pose = newPose(scene, scene.arrays.tower_shape.shape[0]);
    this.point = this.mode = 0;
    this.turning = true;
    this.amplitude = 0.05 * scene.about.turbine.rotor_radius;
    this.zero = 0;
  }

  get now() {
    return this.scene.about.points[this.point];
  }

  /** One period of the vibration is drawn in two seconds, whatever its frequency; the rotor turns as slowly. */
  at(t) {
    const { scene, pose } = this, { arrays, about } = scene, now = this.now, mode = now.modes[this.mode];
    const phase = Math.PI * t, time = phase / mode.frequency, M = pose.tower.length, B = pose.blades.length;
    const shape = arrays.shapes, N = shape.shape[2], K = (N - M - 3) / 3;
    const first = 2 * N * (this.point * shape.shape[1] + this.mode);
    const c = this.amplitude * Math.cos(phase), s = this.amplitude * Math.sin(phase);
    const q = (i) => c * shape[first + 2 * i] - s * shape[first + 2 * i + 1];
    const tower = arrays.tower_shape, L = tower.shape[1];
    pose.top.set([0, 0, about.turbine.tower_base + about.turbine.tower_length]);
    pose.tilt.fill(0);
    for (let m = 0; m < M; m++) {
      pose.tower[m] = q(m);
      for (let k = 0; k < 3; k++) {
        pose.top[k] += q(m) * tower[(m * L + L - 1) * 6 + k];
        pose.tilt[k] += q(m) * tower[(m * L + L - 1) * 6 + 3 + k];
      }
    }
    pose.yaw = q(M);
    const spun = (this.turning ? now.rotor_speed : 0) * time;
    pose.azimuth = spun + q(M + 1) + q(M + 2);
    const size = pose.blades[0].length, rest = arrays.steady, basis = arrays.basis;
    for (let b = 0; b < B; b++) {
      pose.pitch[b] = now.pitch;
      const psi = spun + (2 * Math.PI * b) / B, blade = pose.blades[b];
      for (let n = 0; n < size; n++) blade[n] = rest[this.point * size + n];
      for (let k = 0; k < K; k++) {
        const at = M + 3 + 3 * k, x = q(at) + q(at + 1) * Math.cos(psi) + q(at + 2) * Math.sin(psi);
        for (let n = 0, from = (this.point * K + k) * size; n < size; n++, from++) blade[n] += x * basis[from];
      }
    }
    return pose;
  }
}

function newPose(scene, towerCoordinates) {
  const B = scene.about.turbine.blades, S = scene.about.sections.length;
  return {
    top: new Float32Array(3),
    tilt: new Float32Array(3),
    yaw: 0,
    azimuth: 0,
    pitch: new Float32Array(B),
    tower: new Float32Array(towerCoordinates),
    blades: Array.from({ length: B }, () => new Float32Array(6 * S)),
  };
}

/** Rotation matrix, by rows, of a rotation vector (Rodrigues). */
function rotationMatrix(x, y, z, R) {
  const a2 = x * x + y * y + z * z, a = Math.sqrt(a2);
  const s = a > 1e-6 ? Math.sin(a) / a : 1 - a2 / 6, c = a > 1e-6 ? (1 - Math.cos(a)) / a2 : 0.5 - a2 / 24;
  R[0] = 1 - c * (y * y + z * z); R[1] = c * x * y - s * z; R[2] = c * x * z + s * y;
  R[3] = c * x * y + s * z; R[4] = 1 - c * (x * x + z * z); R[5] = c * y * z - s * x;
  R[6] = c * x * z - s * y; R[7] = c * y * z + s * x; R[8] = 1 - c * (x * x + y * y);
  return R;
}
