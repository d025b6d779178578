// Where the joints are: the tree of the hand, and rigid transforms as the first three rows of a matrix, row by row.

const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];

// out = A B; out is neither of them.
function multiply(A, B, out) {
  for (let r = 0; r < 12; r += 4) {
    const a = A[r], b = A[r + 1], c = A[r + 2];
    out[r] = a * B[0] + b * B[4] + c * B[8];
    out[r + 1] = a * B[1] + b * B[5] + c * B[9];
    out[r + 2] = a * B[2] + b * B[6] + c * B[10];
    out[r + 3] = a * B[3] + b * B[7] + c * B[11] + A[r + 3];
  }
  return out;
}

function transformed(T, p) {
  return [0, 4, 8].map((r) => T[r] * p[0] + T[r + 1] * p[1] + T[r + 2] * p[2] + T[r + 3]);
}

function rotated(T, p) {
  return [0, 4, 8].map((r) => T[r] * p[0] + T[r + 1] * p[1] + T[r + 2] * p[2]);
}

function inverted(T) {
  const R = [T[0], T[4], T[8], 0, T[1], T[5], T[9], 0, T[2], T[6], T[10], 0];
  const p = rotated(R, [T[3], T[7], T[11]]);
  [R[3], R[7], R[11]] = p.map((c) => -c);
  return R;
}

// The transform of a position and a quaternion x y z w, which need not have length one.
function fromPose([px, py, pz], [x, y, z, w]) {
  const s = 2 / (x * x + y * y + z * z + w * w);
  return [
    1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w), px,
    s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w), py,
    s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y), pz,
  ];
}

// The unit quaternion x y z w of a transform, w not negative.
function quaternionOf(T) {
  const matrix = new THREE.Matrix4().set(...T, 0, 0, 0, 1);
  const { x, y, z, w } = new THREE.Quaternion().setFromRotationMatrix(matrix);
  return (w < 0 ? [-x, -y, -z, -w] : [x, y, z, w]);
}

class Kinematics {
  constructor(joints) {
    this.joints = joints;
    this.step = new Float64Array(12);
    this.local = new Float64Array(12);
  }

  // Room for the placements of the palm and all joints.
  room() {
    return Array.from({ length: this.joints.length + 1 }, () => Float64Array.from(IDENTITY));
  }

  // Placements in the palm's frame at joint positions [rad or m]; each joint comes after its parent.
  place(positions, placements) {
    this.joints.forEach((joint, i) => {
      this.move(joint, positions[i]);
      multiply(joint.placement, this.step, this.local);
      multiply(placements[joint.parent], this.local, placements[i + 1]);
    });
    return placements;
  }

  // What a joint adds to its placement: a turn about its axis (Rodrigues' formula), or a step along it.
  move(joint, position) {
    const [x, y, z] = joint.axis, T = this.step;
    if (joint.prismatic) {
      T.set(IDENTITY);
      [T[3], T[7], T[11]] = [x * position, y * position, z * position];
      return;
    }
    const c = Math.cos(position), s = Math.sin(position), v = 1 - c;
    T[0] = c + v * x * x; T[1] = v * x * y - s * z; T[2] = v * x * z + s * y; T[3] = 0;
    T[4] = v * x * y + s * z; T[5] = c + v * y * y; T[6] = v * y * z - s * x; T[7] = 0;
    T[8] = v * x * z - s * y; T[9] = v * y * z + s * x; T[10] = c + v * z * z; T[11] = 0;
  }
}

// All that is drawn of one grasp, and written of it.
class Grasps {
  constructor(numbers) {
    this.numbers = numbers;
    this.kinematics = new Kinematics(facts.joints);
    this.count = facts.n_charts + facts.maxima.length;
  }

  // The grasp's placements of joints (into `placements`) and object, contacts, forces and ellipsoid.
  read(grasp, placements = this.kinematics.room()) {
    const row = (name) => this.numbers.get(name).row(grasp);
    const positions = row("positions");
    this.kinematics.place(positions, placements);
    const object = fromPose(row("object_xyz"), row("object_quat"));
    const points = row("contact_points"), normals = row("contact_normals"), forces = row("forces");
    const contacts = facts.contacts.map(({ frame, joint }, i) => ({
      frame,
      point: transformed(placements[joint], points.slice(3 * i, 3 * i + 3)),
      normal: rotated(placements[joint], normals.slice(3 * i, 3 * i + 3)),
      force: forces.slice(3 * i, 3 * i + 3),
    }));
    const axes = row("ellipsoid_axes");
    const ellipsoid = { axes: [axes.slice(0, 3), axes.slice(3, 6)], lengths: row("ellipsoid_lengths") };
    return { grasp, positions, placements, object, contacts, ellipsoid, semiAxes: row("semi_axes") };
  }
}
