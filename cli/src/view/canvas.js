// Drawing in three dimensions, by WebGL2 alone.

const VERTEX = `#version 300 es
in vec3 P; in vec3 N; uniform mat4 M, V; out vec3 n, w;
void main() {
  vec4 x = M * vec4(P, 1.); w = x.xyz; mat3 m = mat3(M);
  n = mat3(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])) * N;
  gl_Position = V * x;
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 n, w; uniform vec4 colour, eye, grid; uniform vec3 centre, paper; uniform int mode; out vec4 o;
void main() {
  if (mode == 1) { o = colour; return; }
  if (mode == 2) {
    vec2 c = w.xy / grid.w, f = fwidth(c);
    vec2 g = abs(fract(c - .5) - .5) / max(f, 1e-6);
    float line = (1. - min(min(g.x, g.y), 1.)) * clamp(.5 / max(f.x, f.y), 0., 1.);
    float d = length(w.xy - centre.xy) / eye.w;
    o = vec4(mix(colour.rgb, grid.rgb, line), colour.a * (1. - smoothstep(.35, 1., d)));
    return;
  }
  vec3 v = normalize(eye.xyz - w), m = normalize(n);
  if (dot(m, v) < 0.) m = -m;
  vec3 key = normalize(v + vec3(-.3, -.2, .9));
  float k = max(dot(m, key), 0.), up = .5 + .5 * m.z, edge = pow(1. - max(dot(m, v), 0.), 3.);
  vec3 c = colour.rgb * (.42 + .16 * up + .46 * k) + .1 * pow(max(dot(m, normalize(key + v)), 0.), 40.);
  o = vec4(mix(c, paper, .18 * edge), colour.a);
}`;

/** Drawing on a canvas. Throws where the browser has no WebGL2. */
class Canvas {
  constructor(element) {
    this.element = element;
    const gl = element.getContext("webgl2", { antialias: false, stencil: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("this browser draws no WebGL2: enable hardware acceleration, or take another browser");
    this.gl = gl;
    /** Share of the screen's pixels along an edge that a picture has: less than 1 where the machine draws slowly. */
    this.fineness = 1;
    /** Whether edges are smooth, by several samples a pixel. Without a GPU they take as long as all the rest. */
    this.smooth = true;
    this.view = { yaw: -1.1, pitch: 0.38, distance: 4, at: [0, 0, 0] };
    this.prepare();
    element.addEventListener("webglcontextlost", (event) => event.preventDefault());
    element.addEventListener("webglcontextrestored", () => (this.prepare(), this.restored?.()));
  }

  /** Program and meshes. */
  prepare() {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.bindAttribLocation(program, 0, "P");
    gl.bindAttribLocation(program, 1, "N");
    gl.linkProgram(program);
    this.program = program;
    this.places = {};
    for (const name of ["M", "V", "colour", "eye", "grid", "centre", "paper", "mode"]) this.places[name] = gl.getUniformLocation(program, name);
    this.meshes = {};
    for (const [name, make] of Object.entries({ tube, cylinder, cone, box, square })) this.meshes[name] = this.mesh(make());
    this.samples = null;
  }

  /** Where a picture is drawn: while `smooth` in a buffer of several samples a pixel, otherwise on the canvas. */
  aim() {
    const { gl, element: { width: w, height: h } } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    if (!this.smooth) return;
    if (this.samples?.w !== w || this.samples.h !== h) {
      this.samples?.parts.forEach((part) => gl.deleteRenderbuffer(part));
      const buffer = this.samples?.buffer ?? gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, buffer);
      const parts = [[gl.RGBA8, gl.COLOR_ATTACHMENT0], [gl.DEPTH24_STENCIL8, gl.DEPTH_STENCIL_ATTACHMENT]].map(([format, place]) => {
        const part = gl.createRenderbuffer();
        gl.bindRenderbuffer(gl.RENDERBUFFER, part);
        gl.renderbufferStorageMultisample(gl.RENDERBUFFER, 4, format, w, h);
        gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, part);
        return part;
      });
      this.samples = { buffer, parts, w, h };
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.samples.buffer);
  }

  /** Ends a picture. */
  end() {
    if (!this.smooth) return;
    const { gl, samples: { w, h } } = this;
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    gl.blitFramebuffer(0, 0, w, h, 0, 0, w, h, gl.COLOR_BUFFER_BIT, gl.NEAREST);
  }

  mesh(corners) {
    const gl = this.gl, array = gl.createVertexArray(), buffer = gl.createBuffer(), order = gl.createBuffer(), { kept, indices } = shared(corners);
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, kept, gl.STATIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, order);
    // All triangles, then the few of a coarse picture.
    const coarse = undivided(indices), all = new Uint32Array(indices.length + coarse.length);
    all.set(indices);
    all.set(coarse, indices.length);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, all, gl.STATIC_DRAW);
    for (const k of [0, 1]) {
      gl.enableVertexAttribArray(k);
      gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 24, 12 * k);
    }
    return { array, buffers: [buffer, order], fine: [indices.length, 0], coarse: [coarse.length, 4 * indices.length] };
  }

  free(mesh) {
    this.gl.deleteVertexArray(mesh.array);
    mesh.buffers.forEach((buffer) => this.gl.deleteBuffer(buffer));
  }

  /** Sets eye and projection for the size that the canvas has. */
  camera() {
    const { element, view } = this, ratio = this.fineness * Math.min(devicePixelRatio || 1, 2);
    const [w, h] = [Math.max(1, Math.round(element.clientWidth * ratio)), Math.max(1, Math.round(element.clientHeight * ratio))];
    if (element.width !== w || element.height !== h) [element.width, element.height] = [w, h];
    this.gl.viewport(0, 0, w, h);
    const d = [Math.cos(view.pitch) * Math.cos(view.yaw), Math.cos(view.pitch) * Math.sin(view.yaw), Math.sin(view.pitch)];
    this.eye = add(view.at, times(view.distance, d));
    this.towards = d;
    this.right = unit(cross([0, 0, 1], d));
    this.up = cross(d, this.right);
    const { right: r, up: u, eye } = this;
    const turn = [r[0], u[0], d[0], 0, r[1], u[1], d[1], 0, r[2], u[2], d[2], 0, -dot(r, eye), -dot(u, eye), -dot(d, eye), 1];
    // A tall canvas sees as much across as a wide one sees upwards.
    this.focus = 2.4 * Math.min(1, (1.15 * w) / h);
    const near = 0.01 * view.distance, far = 80 * view.distance, f = this.focus;
    this.matrix = product([(f * h) / w, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0], turn);
  }

  /** Where a point is on the canvas, in pixels of the page, and its distance; `null` behind the eye. */
  project(p) {
    const m = this.matrix, [x, y, , w] = [0, 1, 2, 3].map((i) => m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i]);
    if (w <= 0) return null;
    return [(x / w / 2 + 0.5) * this.element.clientWidth, (0.5 - y / w / 2) * this.element.clientHeight, w];
  }

  /** The ray through a place of the canvas: origin and direction. */
  ray(x, y) {
    const { clientWidth: w, clientHeight: h } = this.element, f = this.focus;
    const [a, b] = [((2 * x) / w - 1) * (w / h) / f, (1 - (2 * y) / h) / f];
    return { origin: this.eye, way: unit(add(times(-1, this.towards), add(times(a, this.right), times(b, this.up)))) };
  }

  /** Length at some distance that is a pixel of the page, m. */
  pixel(distance) {
    return (2 * distance) / this.focus / this.element.clientHeight;
  }

  begin(paper) {
    const { gl, places } = this;
    this.camera();
    this.aim();
    gl.clearColor(...paper, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.useProgram(this.program);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE);
    gl.uniformMatrix4fv(places.V, false, this.matrix);
    gl.uniform4fv(places.eye, [...this.eye, 1]);
    gl.uniform3fv(places.paper, paper);
  }

  /** Draws a mesh: lit (mode 0), or in one colour (1). */
  draw(mesh, matrix, colour, mode = 0) {
    const { gl, places } = this;
    gl.uniformMatrix4fv(places.M, false, matrix);
    gl.uniform4fv(places.colour, colour);
    gl.uniform1i(places.mode, mode);
    gl.bindVertexArray(mesh.array);
    const [count, from] = this.fineness < 1 ? mesh.coarse : mesh.fine;
    gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, from);
  }

  /** A floor at a height about a place, with a grid of lines, that fades at a distance. */
  floor(height, [x, y], reach, step, colour, line) {
    const { gl, places } = this;
    gl.uniform4fv(places.eye, [...this.eye, reach]);
    gl.uniform4fv(places.grid, [...line, step]);
    gl.uniform3fv(places.centre, [x, y, height]);
    // It hides nothing, so that what stands below it is seen.
    gl.depthMask(false);
    this.draw(this.meshes.square, [reach, 0, 0, 0, 0, reach, 0, 0, 0, 0, 1, 0, x, y, height, 1], colour, 2);
    gl.depthMask(true);
  }

  /** Draws shadows: every place is darkened once. */
  shadows(draw) {
    const gl = this.gl;
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.depthMask(false);
    draw();
    gl.depthMask(true);
    gl.disable(gl.STENCIL_TEST);
  }

  arrow(from, way, radius, colour) {
    const length = size(way);
    if (!(length > 4 * radius)) return;
    const head = Math.min(length, 9 * radius), neck = add(from, times(1 - head / length, way));
    this.draw(this.meshes.tube, along(from, neck, radius), colour, 0);
    this.draw(this.meshes.cone, along(neck, add(from, way), 2.6 * radius), colour, 0);
  }
}
