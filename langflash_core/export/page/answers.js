// What Gaussians say to phrases, and whether a picture answers one. Twins: app/gl/fast.py,
// langflash_core/language/rivals.py and answers.py, whose constants these are.

const EMPTY_NORM = 1e-4; // |F| of pixels that say nothing
const COVERED_ALPHA = 0.5; // from here on a pixel shows the scene
const TOP_FRACTION = 0.001; // of the covered pixels: their mean is the score
const MIN_AREA = 0.0005; // of all pixels: a smaller mask is noise
const BINS = 4096;
const SUREST = 0.9999; // no score counts for more
const KIN = 0.6; // cosine of names that mean the same
const BEHIND = 0.8; // of how much a phrase is behind the best other name, what it loses

// rows of a flat table (rows, C) times a vector (C,).
function products(table, vector) {
  return Float32Array.from({ length: table.length / vector.length }, (_, row) => {
    return vector.reduce((sum, value, c) => sum + value * table[row * vector.length + c], 0);
  });
}

class Answers {
  // phrases: of readPhrases: P scores and M negatives of K numbers each; gram (K, K), dictionary (K, C) as
  // phrases meet it, and rivals (V, C), flat; lead: what one gets that nothing beats.
  constructor(phrases, count) {
    Object.assign(this, phrases);
    this.count = count;
    this.norms = this.featureNorms();
    this.against = new Float32Array(count).fill(-Infinity); // the best negative of each Gaussian
    for (const negative of this.negatives) {
      const mixed = this.mixed(negative);
      for (let i = 0; i < count; ++i) this.against[i] = Math.max(this.against[i], mixed[i]);
    }
  }

  // Take in a phrase by its unit vector (C,); its row.
  learn(text, vector) {
    const kin = products(this.rivals, vector).map((cosine) => cosine > KIN);
    const scores = products(this.dictionary, vector).map((score, atom) => {
      const length = Math.sqrt(this.gram[atom * (this.atoms + 1)]);
      const best = this.named(atom, vector.length).reduce(
        (most, value, name) => (kin[name] ? most : Math.max(most, value)),
        -Infinity,
      );
      return score + this.lead * length - BEHIND * Math.max(0, best - score);
    });
    this.scores.push(scores);
    return this.texts.push(text) - 1;
  }

  // d_k . n (V,) of an atom and the names that rival phrases.
  named(atom, channels) {
    this.names ??= Array.from({ length: this.atoms }, (_, k) => {
      return products(this.rivals, this.dictionary.subarray(k * channels, (k + 1) * channels));
    });
    return this.names[atom];
  }

  // sum_k w_ik a_k (count,) of scores a (K,).
  mixed(scores) {
    const sums = new Float32Array(this.count);
    for (const { atoms, shares } of this.weights)
      for (let i = 0; i < this.count; ++i) sums[i] += shares[i] * scores[atoms[i]];
    const totals = this.shareTotals();
    for (let i = 0; i < this.count; ++i) sums[i] /= totals[i];
    return sums;
  }

  // What the shares of each Gaussian sum up to; 1 where it carries nothing.
  shareTotals() {
    if (!this.totals) {
      this.totals = new Float32Array(this.count);
      for (const { shares } of this.weights) for (let i = 0; i < this.count; ++i) this.totals[i] += shares[i];
      for (let i = 0; i < this.count; ++i) this.totals[i] = this.totals[i] || 1;
    }
    return this.totals;
  }

  // |f_i| (count,), out of w^T G w.
  featureNorms() {
    const totals = this.shareTotals();
    return new Float32Array(this.count).map((_, i) => {
      let square = 0;
      for (const one of this.weights)
        for (const two of this.weights)
          square += one.shares[i] * two.shares[i] * this.gram[one.atoms[i] * this.atoms + two.atoms[i]];
      return Math.sqrt(Math.max(square, 0)) / totals[i];
    });
  }

  // Texels (count, layers, 4) float32 of numbers to splat: |f|, then f . t less the best negative of each phrase.
  numbers(rows) {
    const layers = Math.ceil((1 + rows.length) / 3);
    const texels = new Float32Array(4 * layers * this.count);
    const write = (place, values) => {
      const first = 4 * Math.floor(place / 3) + (place % 3);
      for (let i = 0; i < this.count; ++i) texels[4 * layers * i + first] = values[i];
    };
    write(0, this.norms);
    rows.forEach((row, place) => {
      write(
        place + 1,
        this.mixed(this.scores[row]).map((score, i) => score - this.against[i]),
      );
    });
    return { texels, layers };
  }

  relevance(norm, difference) {
    return norm < EMPTY_NORM ? 0 : 1 / (1 + Math.exp((-this.temperature * difference) / norm));
  }
}

// {score, found, area, lit} of relevance and alpha, one number a pixel each; lit: from which a pixel shows it.
function judged(relevance, alpha, { threshold, half }) {
  const covered = relevance.filter((_, pixel) => alpha[pixel] >= COVERED_ALPHA);
  const score = meanOfHighest(covered, Math.ceil(TOP_FRACTION * covered.length));
  const lit = litFrom(score, threshold, half);
  const area = covered.reduce((sum, value) => sum + (value >= lit), 0) / relevance.length;
  return { score, area, lit, found: score >= threshold && area >= MIN_AREA };
}

// The relevancy from which pixels belong to the mask of a phrase that scores so.
function litFrom(score, threshold, half) {
  if (!half || score <= 0.5 || score < threshold) return threshold;
  return 1 / (1 + (1 / Math.min(score, SUREST) - 1) ** half);
}

// Mean of the `most` highest of values in [0, 1]; 0 of none. Sorts the few bins that matter.
function meanOfHighest(values, most) {
  const bin = (value) => Math.min(BINS - 1, Math.floor(value * BINS));
  const counts = new Uint32Array(BINS);
  for (const value of values) ++counts[bin(value)];
  let lowest = BINS - 1;
  for (let passed = counts[lowest]; passed < most && lowest > 0; passed += counts[lowest]) --lowest;
  const highest = values
    .filter((value) => bin(value) >= lowest)
    .sort()
    .slice(-most);
  return most ? highest.reduce((sum, value) => sum + value, 0) / most : 0;
}
