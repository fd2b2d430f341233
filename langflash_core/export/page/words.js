// The text tower in the page: MiniLM-L6-v2, phrases to 384 unit numbers. Twin: langflash_core/language/minilm.py.
// T tokens, C = 384 channels; activations are (T, C) float32, flat. Matrices are int8 rows with a scale each.

const LAYERS = 6,
  HEADS = 12,
  NORM_EPS = 1e-12;
const MOST_TOKENS = 256;
const LONGEST_WORD = 100; // letters; longer ones are unknown

// float32 of the bits of a float16.
function half(bits) {
  const [exponent, share] = [(bits >> 10) & 31, bits & 1023];
  const size = exponent ? 2 ** (exponent - 15) * (1 + share / 1024) : 2 ** -24 * share;
  return bits & 32768 ? -size : size;
}

// Abramowitz and Stegun 7.1.26: to 1.5e-7.
function erf(x) {
  const t = 1 / (1 + 0.3275911 * Math.abs(x));
  const sum =
    t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))));
  return Math.sign(x) * (1 - sum * Math.exp(-x * x));
}

class TextTower {
  // bytes: of the safetensors file. tokens: the vocabulary, by id.
  constructor(bytes, tokens) {
    this.bytes = bytes;
    this.start = 8 + Number(new DataView(bytes.buffer).getBigUint64(0, true));
    this.described = JSON.parse(new TextDecoder().decode(bytes.subarray(8, this.start)));
    this.ids = new Map(tokens.map((token, id) => [token, id]));
    this.kept = new Map();
  }

  // A tensor by name: int8 as it is, float16 as float32.
  tensor(name) {
    if (!this.kept.has(name)) {
      const {
        dtype,
        data_offsets: [first, end],
      } = this.described[name];
      const part = this.bytes.slice(this.start + first, this.start + end).buffer;
      this.kept.set(
        name,
        dtype === "I8" ? new Int8Array(part) : Float32Array.from(new Uint16Array(part), half),
      );
    }
    return this.kept.get(name);
  }

  // Unit vector (C,) of a prompt: phrases added and taken away by " + " and " - ". Raises an Error for people.
  encode(prompt) {
    const [first, ...rest] = ` ${prompt} `.split(/\s+([+-])\s+/);
    const sum = this.phrase(first);
    for (let at = 0; at < rest.length; at += 2)
      for (const [c, value] of this.phrase(rest[at + 1]).entries())
        sum[c] += rest[at] === "+" ? value : -value;
    const size = Math.hypot(...sum);
    if (size < 1e-3) throw new Error("This cancels itself out; take another phrase away.");
    return sum.map((value) => value / size);
  }

  // Ids, [CLS] first and [SEP] last.
  tokens(text) {
    const [unknown, opening, closing] = ["[UNK]", "[CLS]", "[SEP]"].map((token) => this.ids.get(token));
    const plain = text
      .replace(/[\p{Cc}\p{Cf}\ufffd]/gu, (letter) => (/\s/.test(letter) ? " " : ""))
      .replace(/[\u3400-\u4dbf\u4e00-\u9fff\uf900-\ufaff]|[\u{20000}-\u{2ceaf}]/gu, " $& ")
      .normalize("NFD")
      .replace(/\p{Mn}/gu, "")
      .toLowerCase();
    const words = plain.match(/[!-/:-@[-`{-~\p{P}]|[^\s!-/:-@[-`{-~\p{P}]+/gu) || [];
    const ids = words.flatMap((word) => this.pieces(word) || [unknown]);
    if (ids.every((id) => id === unknown))
      throw new Error("The text model knows no word of this; use plain words.");
    return [opening, ...ids.slice(0, MOST_TOKENS - 2), closing];
  }

  // Ids of the longest pieces of a word, from the left; null where one is missing.
  pieces(word) {
    const letters = [...word];
    const ids = [];
    for (let start = 0; start < letters.length; ) {
      let end = letters.length;
      const piece = () => (start ? "##" : "") + letters.slice(start, end).join("");
      while (end > start && !this.ids.has(piece())) --end;
      if (end === start || letters.length > LONGEST_WORD) return null;
      ids.push(this.ids.get(piece()));
      start = end;
    }
    return ids;
  }

  // Unit vector (C,) of one phrase.
  phrase(text) {
    let hidden = this.embedded(this.tokens(text));
    for (let layer = 0; layer < LAYERS; ++layer) hidden = this.layer(`encoder.layer.${layer}.`, hidden);
    const channels = this.tensor("embeddings.LayerNorm.weight").length;
    const sum = new Float32Array(channels);
    for (let at = 0; at < hidden.length; ++at) sum[at % channels] += hidden[at];
    const size = Math.hypot(...sum);
    return sum.map((value) => value / size);
  }

  // Word, place and type of each token, normalised.
  embedded(ids) {
    const [words, places] = ["word", "position"].map((what) =>
      this.tensor(`embeddings.${what}_embeddings.weight`),
    );
    const [wordScales, placeScales] = ["word", "position"].map((what) =>
      this.tensor(`embeddings.${what}_embeddings.weight.scale`),
    );
    const types = this.tensor("embeddings.token_type_embeddings.weight");
    const channels = words.length / wordScales.length;
    const hidden = new Float32Array(ids.length * channels).map((_, at) => {
      const [token, c] = [Math.floor(at / channels), at % channels];
      const word = wordScales[ids[token]] * words[ids[token] * channels + c];
      return word + placeScales[token] * places[at] + types[c];
    });
    return this.normalised("embeddings.LayerNorm", hidden);
  }

  layer(name, hidden) {
    const mixed = this.linear(
      name + "attention.output.dense",
      this.attended(name + "attention.self.", hidden),
    );
    const between = this.normalised(
      name + "attention.output.LayerNorm",
      mixed.map((value, at) => value + hidden[at]),
    );
    const wide = this.linear(name + "intermediate.dense", between).map(
      (value) => 0.5 * value * (1 + erf(value * Math.SQRT1_2)),
    );
    const narrow = this.linear(name + "output.dense", wide);
    return this.normalised(
      name + "output.LayerNorm",
      narrow.map((value, at) => value + between[at]),
    );
  }

  // W x + b of every token.
  linear(name, input) {
    const [matrix, scales, bias] = [".weight", ".weight.scale", ".bias"].map((end) =>
      this.tensor(name + end),
    );
    const [rows, columns] = [bias.length, matrix.length / bias.length];
    const count = input.length / columns;
    const output = new Float32Array(count * rows);
    for (let row = 0; row < rows; ++row)
      for (let token = 0; token < count; ++token) {
        let sum = 0;
        const [w, x] = [row * columns, token * columns];
        for (let c = 0; c < columns; ++c) sum += matrix[w + c] * input[x + c];
        output[token * rows + row] = scales[row] * sum + bias[row];
      }
    return output;
  }

  normalised(name, hidden) {
    const [weight, bias] = [this.tensor(name + ".weight"), this.tensor(name + ".bias")];
    const channels = weight.length;
    for (let first = 0; first < hidden.length; first += channels) {
      const row = hidden.subarray(first, first + channels);
      const mean = row.reduce((sum, value) => sum + value, 0) / channels;
      const variance = row.reduce((sum, value) => sum + (value - mean) ** 2, 0) / channels;
      const scale = 1 / Math.sqrt(variance + NORM_EPS);
      for (let c = 0; c < channels; ++c) row[c] = (row[c] - mean) * scale * weight[c] + bias[c];
    }
    return hidden;
  }

  // Each head's softmax of q . k over the tokens, times their v.
  attended(name, hidden) {
    const [queries, keys, values] = ["query", "key", "value"].map((part) => this.linear(name + part, hidden));
    const channels = this.tensor(name + "query.bias").length;
    const [count, width] = [hidden.length / channels, channels / HEADS];
    const output = new Float32Array(hidden.length);
    for (let head = 0; head < channels; head += width)
      for (let token = 0; token < count; ++token) {
        const scores = Float32Array.from({ length: count }, (_, other) => {
          let sum = 0;
          for (let c = head; c < head + width; ++c)
            sum += queries[token * channels + c] * keys[other * channels + c];
          return sum / Math.sqrt(width);
        });
        const highest = Math.max(...scores);
        const shares = scores.map((score) => Math.exp(score - highest));
        const total = shares.reduce((sum, share) => sum + share, 0);
        for (let other = 0; other < count; ++other)
          for (let c = head; c < head + width; ++c)
            output[token * channels + c] += (shares[other] / total) * values[other * channels + c];
      }
    return output;
  }
}
