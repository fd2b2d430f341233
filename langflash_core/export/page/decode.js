// The scene out of the page: base64, deflate, columns of small integers; export/html.py wrote them.

const TEXELS = 4; // a Gaussian takes in its texture: see shaders/web/project.vert

// Bytes of a base64 text that holds a zlib stream.
async function inflated(text) {
  if (typeof DecompressionStream === "undefined")
    throw new Error("This browser is too old to unpack the scene; update it, or try another.");
  const packed = atob(text);
  const bytes = new Uint8Array(packed.length);
  for (let i = 0; i < packed.length; ++i) bytes[i] = packed.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// {name: Uint8Array or Uint16Array} of the header's [name, count, width, differences].
function readColumns(described, bytes) {
  const columns = {};
  let start = 0;
  for (const [name, count, width, differences] of described) {
    const values = width === 2 ? new Uint16Array(count) : new Uint8Array(count);
    for (let byte = 0; byte < width; ++byte, start += count)
      for (let i = 0; i < count; ++i) values[i] |= bytes[start + i] << (8 * byte);
    if (differences) summedUp(values, width);
    columns[name] = values;
  }
  return columns;
}

// Differences, of 16 bits in zigzag, to values, in place; the array's own width takes the remainder.
function summedUp(values, width) {
  let last = 0;
  for (let i = 0; i < values.length; ++i) {
    const step = values[i];
    last += width === 1 ? step : step & 1 ? -((step + 1) >> 1) : step >> 1;
    values[i] = last;
    last = values[i];
  }
}

// Texels (count, TEXELS, 4) float32: mean and opacity; quaternion wxyz; scales and palette entry; f_dc.
function gaussianTexels(header, columns) {
  const texels = new Float32Array(16 * header.count);
  const scales = header.scaleBook.map(Math.exp);
  const span = header.highest.map((high, axis) => (high - header.lowest[axis]) / 65535);
  for (let i = 0; i < header.count; ++i) {
    const at = 16 * i;
    for (let axis = 0; axis < 3; ++axis) {
      const log = header.lowest[axis] + span[axis] * columns["mean" + axis][i];
      texels[at + axis] = Math.sign(log) * Math.expm1(Math.abs(log));
      texels[at + 8 + axis] = scales[columns["scale" + axis][i]];
      texels[at + 12 + axis] = header.colourBook[columns["colour" + axis][i]];
    }
    texels[at + 3] = columns.opacity[i] / 255;
    texels[at + 11] = columns.label ? columns.label[i] : 0;
    writeQuaternion(texels, at + 4, columns.largest[i], columns, i);
  }
  return texels;
}

// wxyz out of its three smallest entries and the place of the largest.
function writeQuaternion(texels, at, largest, columns, row) {
  let rest = 1;
  for (let part = 0, entry = 0; entry < 4; ++entry) {
    if (entry === largest) continue;
    const value = ((columns["turn" + part++][row] / 255) * 2 - 1) * Math.SQRT1_2;
    texels[at + entry] = value;
    rest -= value * value;
  }
  texels[at + largest] = Math.sqrt(Math.max(0, rest));
}

// Texels (entries, bases, 4) float32 of harmonics above degree 0; null where there are none.
function paletteTexels(header, columns) {
  if (!columns.palette) return null;
  const places = columns.palette;
  const texels = new Float32Array((places.length / 3) * 4);
  for (let i = 0; i < places.length; ++i)
    texels[4 * Math.floor(i / 3) + (i % 3)] = header.harmonicsBook[places[i]];
  return texels;
}

// What phrases are answered from: see Answers. Null for a scene without language.
function readPhrases(header, columns) {
  const phrases = header.phrases;
  if (!phrases) return null;
  const weights = [];
  for (let place = 0; columns["atom" + place]; ++place)
    weights.push({ atoms: columns["atom" + place], shares: columns["weight" + place] });
  const numbers = (name) => {
    const unit = phrases[name + "Unit"];
    return Float32Array.from(new Int16Array(columns[name].buffer), (value) => value * unit);
  };
  const rows = (table) =>
    Array.from({ length: table.length / phrases.atoms }, (_, row) => {
      return table.subarray(row * phrases.atoms, (row + 1) * phrases.atoms);
    });
  return {
    ...phrases,
    weights,
    scores: rows(numbers("scores")),
    negatives: rows(numbers("negatives")),
    gram: numbers("gram"),
    dictionary: columns.dictionary ? numbers("dictionary") : null,
    rivals: columns.rivals ? numbers("rivals") : null,
  };
}
