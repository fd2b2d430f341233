// Gaussians in the order in which they are drawn: farthest first, of equal depths the later row first, as the
// renderer of the program has it. A radix sort of the depths' bits: positive floats sort like integers.

const NEAR = 0.01; // scene units; what is nearer touches the eye
const BITS = 11; // a pass; three passes take 32

class Sorter {
  // texels: of gaussianTexels.
  constructor(texels) {
    this.count = texels.length / 16;
    this.texels = texels;
    this.depths = new Float32Array(this.count);
    this.bits = new Uint32Array(this.depths.buffer);
    this.rows = new Uint32Array(this.count);
    this.other = new Uint32Array(this.count);
    this.starts = new Uint32Array(1 << BITS);
  }

  // The rows to draw (a view that the next call overwrites), seen along unit `forward` from `eye`, from `near` on.
  order(eye, forward, near = NEAR) {
    const { texels, depths } = this;
    let seen = 0;
    for (let i = this.count - 1; i >= 0; --i) {
      const at = 16 * i;
      depths[i] =
        (texels[at] - eye[0]) * forward[0] +
        (texels[at + 1] - eye[1]) * forward[1] +
        (texels[at + 2] - eye[2]) * forward[2];
      if (depths[i] >= near) this.rows[seen++] = i;
    }
    for (let shift = 0; shift < 32; shift += BITS) this.pass(seen, shift);
    return this.rows.subarray(0, seen);
  }

  // One stable pass over BITS of the depths, largest first.
  pass(seen, shift) {
    const { bits, rows, other, starts } = this;
    const top = (1 << BITS) - 1;
    starts.fill(0);
    for (let i = 0; i < seen; ++i) ++starts[top - ((bits[rows[i]] >>> shift) & top)];
    for (let key = 0, sum = 0; key <= top; ++key) {
      const count = starts[key];
      starts[key] = sum;
      sum += count;
    }
    for (let i = 0; i < seen; ++i) other[starts[top - ((bits[rows[i]] >>> shift) & top)]++] = rows[i];
    this.rows = other;
    this.other = rows;
  }
}
