// The splat renderer of the page: WebGL 2, instanced quads back to front, premultiplied, targets of float16.
// A target is a picture's colour (sum of T alpha c, sum of T alpha) and up to three layers of numbers.

const MOST_LAYERS = 3; // beside the colour: every WebGL 2 draws into four textures
const BATCH = 256; // quads an instance
const PHRASES_A_PASS = 3 * MOST_LAYERS - 1;
const BACKGROUND = [0.043, 0.051, 0.063];

class Drawing {
  // Raises an Error whose message is for people.
  constructor(canvas, header, texels, palette) {
    const gl = canvas.getContext("webgl2", {
      antialias: false,
      alpha: false,
      powerPreference: "high-performance",
    });
    if (!gl)
      throw new Error("This browser has no WebGL 2, which the picture needs; try another, or update it.");
    if (!gl.getExtension("EXT_color_buffer_float") && !gl.getExtension("EXT_color_buffer_half_float"))
      throw new Error("This graphics driver cannot draw into numbers of 16 bits; try another browser.");
    this.gl = gl;
    this.header = header;
    this.sorter = new Sorter(texels);
    this.programs = new Map();
    this.gaussians = this.table(texels, TEXELS);
    this.palette = palette ? this.table(palette, header.bases) : this.gaussians;
    this.degree = palette ? Math.sqrt(header.bases + 1) - 1 : 0;
    const width = Math.min(2048, header.count);
    this.order = this.texture([width, Math.ceil(header.count / width)], gl.R32UI, gl.NEAREST);
    this.rows = new Uint32Array(width * Math.ceil(header.count / width));
    this.quads = this.batch();
    this.nothing = gl.createVertexArray();
  }

  // Two triangles of vertices 4 i to 4 i + 3 for each of BATCH quads.
  batch() {
    const { gl } = this;
    const corners = [0, 1, 2, 2, 1, 3];
    const indices = Uint16Array.from({ length: 6 * BATCH }, (_, i) => 4 * Math.floor(i / 6) + corners[i % 6]);
    const made = gl.createVertexArray();
    gl.bindVertexArray(made);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return made;
  }

  // An empty texture of a size in pixels.
  texture([width, height], format, filter) {
    const { gl } = this;
    const made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
    for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T])
      gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
    for (const size of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
      gl.texParameteri(gl.TEXTURE_2D, size, filter);
    return made;
  }

  // A texture of texels (., 4) float32, rows of whole entries of so many texels.
  table(texels, entry) {
    const { gl } = this;
    const most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    const count = texels.length / 4;
    const width = Math.min(entry * Math.floor(2048 / entry), Math.max(count, 1));
    const height = Math.max(1, Math.ceil(count / width));
    if (height > most)
      throw new Error("The scene is too large for this graphics driver; open it on another machine.");
    const padded = new Float32Array(4 * width * height);
    padded.set(texels);
    const texture = this.texture([width, height], gl.RGBA32F, gl.NEAREST);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RGBA, gl.FLOAT, padded);
    return texture;
  }

  // {texels, layers} of Answers on the graphics card, for splat; the caller drops it.
  upload(numbers) {
    return { texture: this.table(numbers.texels, numbers.layers), layers: numbers.layers };
  }

  drop(numbers) {
    this.gl.deleteTexture(numbers.texture);
  }

  // A target of so many pixels and layers of numbers.
  target([width, height], layers) {
    const { gl } = this;
    const textures = [];
    const framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    for (let place = 0; place <= layers; ++place) {
      const texture = this.texture([width, height], gl.RGBA16F, gl.LINEAR);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + place, gl.TEXTURE_2D, texture, 0);
      textures.push(texture);
    }
    return { framebuffer, textures, size: [width, height], drawn: [width, height] };
  }

  release(target) {
    for (const texture of target.textures) this.gl.deleteTexture(texture);
    this.gl.deleteFramebuffer(target.framebuffer);
  }

  // Splat the scene into the corner of a target that the lens fills, with numbers of `upload` or null; what is nearer
  // than `near` is left out.
  splat(target, camera, lens, numbers, near = NEAR) {
    const { gl } = this;
    const layers = numbers ? numbers.layers : 0;
    const count = this.sort(camera, near);
    target.drawn = lens.size;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
    gl.drawBuffers(
      target.textures.map((_, place) => (place <= layers ? gl.COLOR_ATTACHMENT0 + place : gl.NONE)),
    );
    gl.viewport(0, 0, ...lens.size);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const program = this.program("splat.vert", "splat.frag", {
      BATCH,
      LAYERS: layers,
      SH_DEGREE: this.degree,
    });
    gl.useProgram(program.made);
    const { order, gaussians, palette } = this;
    this.bind(program, { order, gaussians, palette, numbers: numbers ? numbers.texture : gaussians });
    gl.uniform1i(program.place("count"), count);
    gl.uniformMatrix3fv(program.place("turn"), true, camera.turn.flat());
    gl.uniform3fv(program.place("eye"), camera.eye);
    gl.uniform4fv(program.place("pinhole"), lens.pinhole);
    gl.uniform2fv(program.place("image_size"), lens.size);
    const [gain, offset] = this.lightAt(camera);
    gl.uniform3fv(program.place("light_gain"), gain);
    gl.uniform3fv(program.place("light_offset"), offset);
    gl.bindVertexArray(this.quads);
    gl.drawElementsInstanced(gl.TRIANGLES, 6 * BATCH, gl.UNSIGNED_SHORT, 0, Math.ceil(count / BATCH));
    gl.disable(gl.BLEND);
  }

  // Gains and offsets of the light in which a camera shows the scene.
  lightAt(camera) {
    return lightAt(this.header, camera);
  }

  // Bring the Gaussians in the order of a camera to the graphics card; how many there are to draw.
  sort(camera, near) {
    const { gl } = this;
    const sorted = this.sorter.order(camera.eye, camera.turn[2], near);
    const width = Math.min(2048, this.header.count);
    this.rows.set(sorted);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.order);
    const height = Math.ceil(sorted.length / width);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RED_INTEGER, gl.UNSIGNED_INT, this.rows);
    return sorted.length;
  }

  // A splatted target on the canvas. phrase: {threshold, temperature} of the one that glows, or null.
  show(target, phrase) {
    const { gl } = this;
    const size = [gl.drawingBufferWidth, gl.drawingBufferHeight];
    const program = this.program("screen.vert", "show.frag", { EMPTY_NORM, ...this.header.constants });
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, ...size);
    gl.bindVertexArray(this.nothing);
    gl.useProgram(program.made);
    this.bind(program, {
      colours: target.textures[0],
      numbers: target.textures[target.textures.length > 1 ? 1 : 0],
    });
    gl.uniform2f(program.place("part"), target.drawn[0] / target.size[0], target.drawn[1] / target.size[1]);
    gl.uniform2fv(program.place("canvas_size"), size);
    gl.uniform3fv(program.place("background"), BACKGROUND);
    gl.uniform1f(program.place("threshold"), phrase ? phrase.threshold : 2);
    gl.uniform1f(program.place("temperature"), phrase ? phrase.temperature : 1);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  // One texture of a target, (height, width, 4) float32, row 0 the top; the part that was drawn.
  read(target, place) {
    const { gl } = this;
    const [width, height] = target.drawn;
    const pixels = new Float32Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
    gl.readBuffer(gl.COLOR_ATTACHMENT0 + place);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, pixels);
    return pixels;
  }

  bind(program, textures) {
    const { gl } = this;
    Object.entries(textures).forEach(([name, texture], place) => {
      gl.activeTexture(gl.TEXTURE0 + place);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(program.place(name), place);
    });
  }

  // A program with these constants, compiled once; `place` finds its uniforms.
  program(vertex, fragment, constants) {
    const key = vertex + JSON.stringify(constants);
    if (!this.programs.has(key)) {
      const { gl } = this;
      const made = gl.createProgram();
      [
        [gl.VERTEX_SHADER, vertex],
        [gl.FRAGMENT_SHADER, fragment],
      ].forEach(([kind, name]) => {
        gl.attachShader(made, this.shader(kind, name, constants));
      });
      gl.linkProgram(made);
      if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
      const places = new Map();
      const place = (name) => {
        if (!places.has(name)) places.set(name, gl.getUniformLocation(made, name));
        return places.get(name);
      };
      this.programs.set(key, { made, place });
    }
    return this.programs.get(key);
  }

  shader(kind, name, constants) {
    const { gl } = this;
    const [version, ...rest] = this.header.shaders[name].split("\n");
    const defines = Object.entries(constants).map(([key, value]) => `#define ${key} ${value}`);
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, [version, ...defines, ...rest].join("\n"));
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS))
      throw new Error(`${name}: ${gl.getShaderInfoLog(shader)}`);
    return shader;
  }
}
