// Pictures of scenes of layers: each layer into a picture of its own, and one of those. Twins:
// langflash_core/splat/compose.py, whose constants DEPTH and CLOSES are, and app/gl/layered.py, whose constant MOVING is.

const DEPTH = 0.1; // of the logarithm of depth, at which two layers still support each other by 1 / e
const CLOSES = 0.005; // share from which a layer lets no light through where it is opaque itself
const MOVING = 2; // layers of a moving picture: the nearest, and the next one where that has holes

// Has what Drawing has. A target of it keeps the layers' pictures, `pictures`, as long as it is there.
class LayeredDrawing {
  // layers: the Worlds; photos: {eye, turn} of each; distance: median, as `chosenLayers` takes it.
  constructor(layers, photos, distance) {
    Object.assign(this, { layers, photos, distance });
    this.moving = false;
    this.drawing = layers[0].drawing; // what is the same for all
    for (const { drawing } of layers) drawing.programs = this.drawing.programs;
    this.places = new Map(); // by layer, what it carries where nothing is asked
  }

  target(size, layers) {
    return this.drawing.target(size, layers);
  }

  release(target) {
    if (target.pictures) this.forget(target);
    this.drawing.release(target);
  }

  forget({ pictures }) {
    this.drawing.gl.deleteTexture(pictures.texture);
    this.drawing.gl.deleteFramebuffer(pictures.framebuffer);
  }

  show(target, phrase) {
    this.drawing.show(target, phrase);
  }

  read(target, place) {
    return this.drawing.read(target, place);
  }

  lightAt(camera) {
    return this.drawing.lightAt(camera);
  }

  // Numbers of LayeredAnswers; each layer's go to the graphics card when it is drawn.
  upload(numbers) {
    return numbers;
  }

  drop({ uploaded }) {
    for (const one of uploaded.values()) this.drawing.drop(one);
    uploaded.clear();
  }

  // As of Drawing; at rest blended, of a moving camera one over the other. Of a cut all layers, in their order.
  splat(target, camera, lens, numbers, near = NEAR) {
    const chosen = chosenLayers(this.photos, this.distance, camera);
    const cut = near !== NEAR;
    const over = this.moving || cut;
    const parts = cut ? [...this.layers.keys()].map((place) => ({ place })) : chosen;
    const seen = this.moving ? parts.slice(0, MOVING) : parts;
    const asked = numbers ? numbers.layers : 0;
    const stride = 1 + asked + (over ? 0 : 1);
    const pictures = this.pictures(target, stride * seen.length);
    for (const [index, { place }] of seen.entries()) {
      const carried = stride > 1 ? this.carried(place, numbers, !over) : null;
      const own = this.slice(pictures, index * stride, stride, target.size);
      this.layers[place].drawing.splat(own, camera, lens, carried, near);
    }
    target.drawn = lens.size;
    this.blend(target, camera, seen, { LAYERS: asked, STRIDE: stride, OVER: over ? 1 : 0 });
  }

  // What a layer carries: numbers of phrases, if any are asked, and to be blended the places of its Gaussians from its
  // photo's.
  carried(place, numbers, placed) {
    const kept = numbers ? numbers.uploaded : this.places;
    const key = `${place} ${placed}`;
    if (!kept.has(key)) {
      const { texels, drawing } = this.layers[place];
      const asked = numbers ? numbers.of(place) : { texels: [], layers: 0 };
      kept.set(key, drawing.upload(placed ? withPlaces(asked, texels, this.photos[place].eye) : asked));
    }
    return kept.get(key);
  }

  // The pictures of layers that belong to a target, at least `depth` of them.
  pictures(target, depth) {
    if (target.pictures?.depth >= depth) return target.pictures;
    if (target.pictures) this.forget(target);
    const { gl } = this.drawing;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, texture);
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGBA16F, ...target.size, depth);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
      gl.texParameteri(gl.TEXTURE_2D_ARRAY, side, gl.NEAREST);
    target.pictures = { texture, depth, framebuffer: gl.createFramebuffer() };
    return target.pictures;
  }

  // Some of these pictures, as a target.
  slice({ texture, framebuffer }, first, count, size) {
    const { gl } = this.drawing;
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    const textures = Array.from({ length: count }, () => texture);
    for (let place = 0; place < count; ++place)
      gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + place, texture, 0, first + place);
    return { framebuffer, textures, size };
  }

  // One picture of all: parts as `chosenLayers` has them.
  blend(target, { eye, turn }, parts, constants) {
    const { gl } = this.drawing;
    const program = this.drawing.program("screen.vert", "blend.frag", {
      ...constants,
      PARTS: parts.length,
      DEPTH,
      CLOSES,
    });
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
    gl.drawBuffers(
      target.textures.map((_, place) => (place <= constants.LAYERS ? gl.COLOR_ATTACHMENT0 + place : gl.NONE)),
    );
    gl.viewport(0, 0, ...target.drawn);
    gl.bindVertexArray(this.drawing.nothing);
    gl.useProgram(program.made);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, target.pictures.texture);
    gl.uniform1i(program.place("pictures"), 0);
    const ahead = ({ place }) => dot(turn[2], plus(this.photos[place].eye, eye, -1));
    gl.uniform2fv(
      program.place("parts"),
      parts.flatMap((part) => [part.weight ?? 0, ahead(part)]),
    );
    gl.uniform3fv(program.place("forward"), turn[2]);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }
}

// {texels, layers} of numbers with one layer more: the places of the Gaussians from an eye.
function withPlaces({ texels: numbers, layers }, gaussians, eye) {
  const count = gaussians.length / 16;
  const texels = new Float32Array(4 * (layers + 1) * count);
  for (let i = 0; i < count; ++i) {
    const at = 4 * (layers + 1) * i;
    for (let j = 0; j < 4 * layers; ++j) texels[at + j] = numbers[4 * layers * i + j];
    for (let axis = 0; axis < 3; ++axis)
      texels[at + 4 * layers + axis] = gaussians[16 * i + axis] - eye[axis];
  }
  return { texels, layers: layers + 1 };
}
