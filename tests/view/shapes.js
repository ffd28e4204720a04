// Triangle meshes and rigid motions that the tests draw with.

/** A box with these half sides. */
export function box(x, y, z) {
  const [positions, normals, indices] = [[], [], []];
  for (let axis = 0; axis < 3; ++axis) {
    for (const sign of [-1, 1]) {
      const first = positions.length / 3;
      for (const [u, v] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
        const corner = [0, 0, 0];
        corner[axis] = sign;
        corner[(axis + 1) % 3] = u;
        corner[(axis + 2) % 3] = v;
        positions.push(corner[0] * x, corner[1] * y, corner[2] * z);
        normals.push(...[0, 1, 2].map((k) => (k === axis ? sign : 0)));
      }
      const order = sign > 0 ? [0, 1, 2, 0, 2, 3] : [0, 2, 1, 0, 3, 2];
      indices.push(...order.map((k) => first + k));
    }
  }
  return { positions, normals, indices };
}

/** A cylinder around z from -half to half with round ends. */
export function capsule(radius, half, around = 20, rings = 5) {
  const [positions, normals, indices] = [[], [], []];
  const rows = [];
  for (let r = -rings; r <= rings; ++r) {
    for (const shift of r === 0 ? [-half, half] : [Math.sign(r) * half]) rows.push([Math.PI / 2 * r / rings, shift]);
  }
  for (const [angle, shift] of rows) {
    for (let a = 0; a <= around; ++a) {
      const turn = 2 * Math.PI * a / around;
      const normal = [Math.cos(angle) * Math.cos(turn), Math.cos(angle) * Math.sin(turn), Math.sin(angle)];
      normals.push(...normal);
      positions.push(radius * normal[0], radius * normal[1], radius * normal[2] + shift);
    }
  }
  for (let r = 0; r + 1 < rows.length; ++r) {
    for (let a = 0; a < around; ++a) {
      const at = r * (around + 1) + a;
      indices.push(at, at + 1, at + around + 2, at, at + around + 2, at + around + 1);
    }
  }
  return { positions, normals, indices };
}

/** A level square of these half sides, seen from above. */
export const square = (half) => ({
  positions: [-half, -half, 0, half, -half, 0, half, half, 0, -half, half, 0],
  normals: [0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1],
  indices: [0, 1, 2, 0, 2, 3],
});

/** Waves over a square, as terrain. */
export function waves(half, cells, height) {
  const [positions, normals, indices] = [[], [], []];
  for (let i = 0; i <= cells; ++i) {
    for (let j = 0; j <= cells; ++j) {
      const [x, y] = [half * (2 * i / cells - 1), half * (2 * j / cells - 1)];
      const slope = [height * Math.cos(x), -height * Math.sin(y)];
      const length = Math.hypot(slope[0], slope[1], 1);
      positions.push(x, y, height * (Math.sin(x) + Math.cos(y) - 1.5));
      normals.push(-slope[0] / length, -slope[1] / length, 1 / length);
      if (i < cells && j < cells) {
        const at = i * (cells + 1) + j;
        indices.push(at, at + cells + 1, at + cells + 2, at, at + cells + 2, at + 1);
      }
    }
  }
  return { positions, normals, indices };
}

/** Columns of a matrix: a shift, a scale along the axes, and a rotation before the shift. */
export function place([x, y, z], [sx, sy, sz] = [1, 1, 1], turn = [0, 0, 0, 1]) {
  const columns = [[sx, 0, 0], [0, sy, 0], [0, 0, sz]].map((axis) => rotated(turn, axis));
  return [...columns[0], 0, ...columns[1], 0, ...columns[2], 0, x, y, z, 1];
}

export const about = (axis, angle) => [0, 1, 2].map((k) => axis[k] * Math.sin(angle / 2)).concat(Math.cos(angle / 2));

/** Product of quaternions x y z w: first b, then a. */
export function times([ax, ay, az, aw], [bx, by, bz, bw]) {
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

export function rotated([x, y, z, w], [a, b, c]) {
  const [tx, ty, tz] = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
  return [a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx];
}
