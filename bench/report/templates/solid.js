// The 3D view: a small WebGL renderer that starts when a still picture is touched.
(() => {
  // three rows of running sums of 16 bit differences, low bytes before high bytes, as columns
  function columns(data, at, count) {
    const size = 3 * count, out = new Uint16Array(size);
    for (let row = 0; row < 3; row++) {
      for (let k = 0, sum = 0; k < count; k++) {
        const place = at + row * count + k;
        sum += (data[place] | data[place + size] << 8) << 16 >> 16;
        out[3 * k + row] = sum;
      }
    }
    return out;
  }

  function normals(places, faces) {
    const out = new Float32Array(places.length);
    for (let f = 0; f < faces.length; f += 3) {
      const [a, b, c] = [faces[f] * 3, faces[f + 1] * 3, faces[f + 2] * 3], u = [], v = [];
      for (let k = 0; k < 3; k++) { u[k] = places[b + k] - places[a + k]; v[k] = places[c + k] - places[a + k]; }
      const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      for (const corner of [a, b, c]) for (let k = 0; k < 3; k++) out[corner + k] += n[k];
    }
    for (let k = 0; k < out.length; k += 3) {
      const length = Math.hypot(out[k], out[k + 1], out[k + 2]) || 1;
      out[k] /= length; out[k + 1] /= length; out[k + 2] /= length;
    }
    return out;
  }

  const VERTEX = `attribute vec3 place, normal; attribute float value;
    uniform mat3 turn; uniform vec3 middle, scale; varying vec3 n; varying float v;
    void main() { vec3 p = turn * (place - middle); n = turn * normal; v = value;
      gl_Position = vec4(p.xy * scale.xy, -p.z * scale.z, 1.0); }`;
  const FRAGMENT = `precision mediump float; uniform sampler2D ramp; varying vec3 n; varying float v;
    void main() { vec3 c = v > 254.5 ? vec3(0.63) : texture2D(ramp, vec2((v / 254.0 * 40.0 + 0.5) / 41.0, 0.5)).rgb;
      gl_FragColor = vec4(c * (0.35 + 0.65 * abs(normalize(n).z)), 1.0); }`;

  function program(gl) {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text); gl.compileShader(shader); gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    gl.useProgram(made);
    return made;
  }

  async function loaded(gl, mesh) {
    const data = new Uint8Array(await inflated(bytes(mesh.data)).arrayBuffer()), at = 6 * mesh.v;
    const steps = columns(data, 0, mesh.v), faces = columns(data, at, mesh.f);
    const places = Float32Array.from(steps, step => step / 4095);
    const values = Float32Array.from(data.subarray(at + 6 * mesh.f, at + 6 * mesh.f + mesh.v));
    const buffer = (kind, content) => { const made = gl.createBuffer(); gl.bindBuffer(kind, made); gl.bufferData(kind, content, gl.STATIC_DRAW); return made; };
    const low = [1, 1, 1], high = [0, 0, 0];
    places.forEach((x, k) => { low[k % 3] = Math.min(low[k % 3], x); high[k % 3] = Math.max(high[k % 3], x); });
    return {
      place: buffer(gl.ARRAY_BUFFER, places), normal: buffer(gl.ARRAY_BUFFER, normals(places, faces)),
      value: buffer(gl.ARRAY_BUFFER, values), faces: buffer(gl.ELEMENT_ARRAY_BUFFER, faces), count: faces.length,
      points: places, middle: low.map((x, k) => (x + high[k]) / 2),
    };
  }

  const times = (a, b) => a.map((_, k) => { const r = 3 * Math.floor(k / 3), c = k % 3; return a[r] * b[c] + a[r + 1] * b[c + 3] + a[r + 2] * b[c + 6]; });
  const about = { x: t => [1, 0, 0, 0, Math.cos(t), -Math.sin(t), 0, Math.sin(t), Math.cos(t)],
    z: t => [Math.cos(t), -Math.sin(t), 0, Math.sin(t), Math.cos(t), 0, 0, 0, 1] };

  class View {
    constructor(box) {
      this.box = box; this.canvas = box.querySelector("canvas"); this.images = [...box.querySelectorAll("img")];
      const data = JSON.parse(box.querySelector("script").textContent);
      this.first = data.view; this.meshes = data.meshes; this.ramp = bytes(data.ramp);
      this.shown = data.first; this.reset();
    }
    reset() { this.yaw = 0; this.pitch = 0; this.zoom = 1; }
    async start() {
      if (this.begun) return this.begun;
      this.begun = (async () => {
        const gl = this.canvas.getContext("webgl", { antialias: true });
        if (!gl || !("DecompressionStream" in window)) { this.box.classList.add("still"); throw new Error("no WebGL"); }
        this.gl = gl; this.program = program(gl);
        gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, 41, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, this.padded());
        for (const [what, how] of [["WRAP_S", "CLAMP_TO_EDGE"], ["WRAP_T", "CLAMP_TO_EDGE"], ["MIN_FILTER", "NEAREST"], ["MAG_FILTER", "NEAREST"]])
          gl.texParameteri(gl.TEXTURE_2D, gl["TEXTURE_" + what], gl[how]);
        gl.enable(gl.DEPTH_TEST);
        this.loaded = [];
        for (const mesh of this.meshes) this.loaded.push(await loaded(gl, mesh));
        this.fit();
        this.canvas.hidden = false; this.box.classList.add("live");
        new ResizeObserver(() => this.draw()).observe(this.canvas);
        this.draw();
      })();
      return this.begun;
    }
    padded() { // rows of textures begin at multiples of four bytes
      const out = new Uint8Array(124); out.set(this.ramp); return out;
    }
    fit() { // as the still picture: all of it inside
      const aspect = 640 / 360, r = this.first;
      this.half = this.loaded.map(mesh => {
        let x = 0, y = 0; const p = mesh.points, m = mesh.middle;
        for (let k = 0; k < p.length; k += 3) {
          const d = [p[k] - m[0], p[k + 1] - m[1], p[k + 2] - m[2]];
          x = Math.max(x, Math.abs(r[0] * d[0] + r[1] * d[1] + r[2] * d[2]));
          y = Math.max(y, Math.abs(r[3] * d[0] + r[4] * d[1] + r[5] * d[2]));
        }
        return Math.max(y, x / aspect) * 1.06;
      });
    }
    async show(number) {
      this.shown = number;
      this.images.forEach((image, k) => { image.hidden = k !== number; });
      if (this.begun) { await this.begun; this.draw(); }
    }
    draw() {
      const { gl, canvas } = this, mesh = this.loaded[this.shown];
      const dense = Math.min(devicePixelRatio || 1, 2);
      canvas.width = Math.max(canvas.clientWidth * dense, 1); canvas.height = Math.max(canvas.clientHeight * dense, 1);
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      const turn = times(about.x(this.pitch), times(this.first, about.z(this.yaw)));
      const set = name => gl.getUniformLocation(this.program, name), half = this.half[this.shown] / this.zoom;
      gl.uniformMatrix3fv(set("turn"), false, [0, 3, 6, 1, 4, 7, 2, 5, 8].map(k => turn[k]));
      gl.uniform3fv(set("middle"), mesh.middle);
      gl.uniform3f(set("scale"), canvas.height / canvas.width / half, 1 / half, 0.5);
      for (const [name, size] of [["place", 3], ["normal", 3], ["value", 1]]) {
        const at = gl.getAttribLocation(this.program, name);
        gl.bindBuffer(gl.ARRAY_BUFFER, mesh[name]); gl.enableVertexAttribArray(at); gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
      }
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.faces);
      gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_SHORT, 0);
    }
    turn(right, up, larger = 1) {
      this.yaw += right; this.pitch = Math.max(-1.5, Math.min(1.5, this.pitch + up));
      this.zoom = Math.max(0.5, Math.min(12, this.zoom * larger));
      this.start().then(() => this.draw(), () => {});
    }
  }

  const KEYS = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1],
    "+": [0, 0, 1.2], "=": [0, 0, 1.2], "-": [0, 0, 1 / 1.2] };

  for (const box of document.querySelectorAll(".solid")) {
    const view = new View(box), fingers = new Map();
    box.view = view;
    const spread = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a.x - b.x, a.y - b.y); };
    box.addEventListener("pointerdown", event => {
      fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      box.setPointerCapture(event.pointerId);
      view.start().catch(() => {});
    });
    box.addEventListener("pointermove", event => {
      const from = fingers.get(event.pointerId);
      if (!from) return;
      const before = fingers.size === 2 ? spread() : 0, step = 5 / box.clientWidth;
      const moved = [event.clientX - from.x, event.clientY - from.y];
      fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      if (fingers.size === 2) view.turn(0, 0, spread() / (before || 1));
      else view.turn(moved[0] * step, moved[1] * step);
    });
    for (const end of ["pointerup", "pointercancel"]) box.addEventListener(end, event => fingers.delete(event.pointerId));
    box.addEventListener("dragstart", event => event.preventDefault());
    box.addEventListener("wheel", event => { // only where the view was chosen, so that the page still scrolls
      if (document.activeElement !== box) return;
      event.preventDefault(); view.turn(0, 0, Math.exp(-event.deltaY / 500));
    }, { passive: false });
    box.addEventListener("keydown", event => {
      if (event.key === "0") { view.reset(); view.turn(0, 0); } else if (KEYS[event.key]) view.turn(...KEYS[event.key]); else return;
      event.preventDefault();
    });
    const choice = box.nextElementSibling;
    if (!choice || !choice.matches(".choice")) continue;
    const buttons = [...choice.querySelectorAll("button")];
    buttons.forEach((button, number) => button.addEventListener("click", () => {
      buttons.forEach((other, k) => other.setAttribute("aria-pressed", String(k === number)));
      view.show(number);
    }));
  }
})();
