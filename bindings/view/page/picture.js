// The picture: points, shapes, ground and axes by three.js; the camera; picking under the pointer.
import * as THREE from "./three.module.js";
import { rampBytes } from "./ramp.js";

const pointVertex = `
  uniform vec3 low, size;
  uniform vec2 radii;
  uniform float pixels, least, dots, gaps, far, largest;
  uniform sampler2D ramp;
  attribute float value, radius;
  attribute vec3 rgb;
  varying vec3 tint;
  varying float pixelRadius, fog;
  void main() {
    vec4 at = modelViewMatrix * vec4(low + position * size, 1.0);
    gl_Position = projectionMatrix * at;
    float wide = 2.0 * mix(radii.x, radii.y, radius) * pixels / max(1e-6, -at.z);
    gl_PointSize = dots > 0.0 ? dots : clamp(wide, least, largest);
    pixelRadius = 0.5 * gl_PointSize;
    fog = exp(-0.35 * max(0.0, -at.z / far - 1.0));
    #ifdef RGB
      tint = rgb;
    #else
      tint = texture2D(ramp, vec2(value * 0.998 + 0.001, 0.5)).rgb;
      // If some have no value, 0 marks them: they recede behind those that have one.
      if (gaps > 0.0) {
        if (value < 0.5 / 65535.0) { tint = vec3(0.45); gl_PointSize = min(gl_PointSize, least); }
        else gl_PointSize = max(gl_PointSize, 2.0 * least);
      }
    #endif
  }`;
// The lighting of pictures (runtime/picture/marks.cpp) without its shadows: colours are encoded as in tone.cpp.
const pictureLight = `
  vec3 decoded(vec3 c) {
    vec3 light = mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
    return mix(light, 0.8 - 0.2 * log(max((1.0 - light) / 0.2, 1e-3)), step(0.8, light));
  }
  vec3 encoded(vec3 light) {
    light = mix(light, 1.0 - 0.2 * exp((0.8 - light) / 0.2), step(0.8, light));
    return mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, light));
  }`;
const pointFragment = `
  uniform float dots;
  varying vec3 tint;
  varying float pixelRadius, fog;
  ${pictureLight}
  void main() {
    vec2 p = 2.0 * gl_PointCoord - 1.0;
    float square = dot(p, p);
    if (dots > 0.0) { gl_FragColor = vec4(tint, 1.0); return; }
    if (square > 1.0) discard;
    vec3 n = vec3(p.x, -p.y, sqrt(1.0 - square));
    vec3 lamp = normalize(vec3(-0.45, 0.0, 0.35) + 0.85 * viewMatrix[1].xyz);
    float facing = 0.5 + 0.5 * dot(n, lamp);
    float roundness = clamp((pixelRadius - 1.2) / 2.5, 0.0, 1.0);
    float shade = mix(0.85, 0.25 + 0.95 * facing * facing, roundness);
    gl_FragColor = vec4(encoded(decoded(tint) * 1.1 * fog * shade), 1.0);
  }`;

// A streak has a vertex at the point and one at its previous position.
const streakVertex = pointVertex.replace("attribute float value, radius;",
  "attribute float value, radius, tail; attribute vec3 velocity; uniform float shutter;")
  .replace("low + position * size", "low + position * size - tail * shutter * velocity");

const up = new THREE.Vector3(0, 1, 0);

export class Picture {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(window.devicePixelRatio || 1);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(35, 1, 0.01, 1000);
    this.target = new THREE.Vector3(0, 1, 0);
    this.turn = 0.6;   // radians about the vertical
    this.tilt = 0.35;
    this.distance = 6;
    this.meshes = new Map();
    this.shapes = new THREE.Group();
    this.ground = new THREE.Group();
    this.lines = new THREE.Group();
    this.scene.add(this.shapes, this.ground, this.lines);
    this.sun = new THREE.DirectionalLight(0xffffff, 0.7);
    this.scene.add(this.sun, new THREE.HemisphereLight(0xffffff, 0x555566, 0.55));
    const texture = new THREE.DataTexture(rampBytes(), 256, 1, THREE.RGBAFormat);
    texture.magFilter = texture.minFilter = THREE.LinearFilter;
    texture.needsUpdate = true;
    this.uniforms = {
      low: { value: new THREE.Vector3() }, size: { value: new THREE.Vector3(1, 1, 1) },
      radii: { value: new THREE.Vector2(0, 0) }, pixels: { value: 1 }, least: { value: 3 }, dots: { value: 0 }, gaps: { value: 0 }, far: { value: 1 },
      largest: { value: this.renderer.getContext().getParameter(this.renderer.getContext().ALIASED_POINT_SIZE_RANGE)[1] },
      shutter: { value: 1 / 48 }, ramp: { value: texture },
    };
    const surface = (colour, given) => new THREE.MeshLambertMaterial({ color: colour, side: THREE.DoubleSide, ...given });
    this.materials = {
      collider: surface(0x9aa3b2), emitter: surface(0x7fae8a, { transparent: true, opacity: 0.35, depthWrite: false }),
      plane: new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.25, side: THREE.DoubleSide, depthWrite: false,
        polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 2 }),
    };
    this.flat = new THREE.PlaneBufferGeometry(1, 1);
    this.style = "discs";
    this.message = null;
    this.marker = this.line(0xffffff);
    this.path = this.line(0xffb454);
    this.drawn = 0; // pictures drawn so far
    this.control();
    canvas.addEventListener("webglcontextrestored", () => { this.kind = ""; if (this.message) this.show(this.message); });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  line(colour) {
    const made = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: colour, depthTest: false, transparent: true }));
    made.renderOrder = 1; // visible through objects in front of it
    made.frustumCulled = false;
    made.visible = false;
    this.lines.add(made);
    return made;
  }

  theme(background, grid) {
    this.scene.background = new THREE.Color(background);
    this.grid = grid;
    this.materials.plane.color.set(grid);
    this.lay();
    this.draw();
  }

  // Lays out grid and axes at the size of the scene.
  lay() {
    for (const child of [...this.ground.children]) { this.ground.remove(child); child.geometry.dispose(); }
    const cell = 10 ** Math.round(Math.log10(this.distance / 12)), wide = 40 * cell;
    const grid = new THREE.GridHelper(wide, 40, this.grid, this.grid);
    const axes = new THREE.AxesHelper(cell);
    axes.position.y = cell * 1e-3;
    this.ground.add(grid, axes);
    this.groundSize = wide;
    for (const shape of this.shapes.children) if (shape.userData.plane) shape.scale.setScalar(wide);
  }

  // ---- the contents ----

  show(message) {
    this.message = message;
    const { arrays, box } = message, streaks = this.style === "streaks" && arrays.v;
    const copies = streaks ? 2 : 1, kind = `${this.style}${Boolean(arrays.colour)}${Boolean(streaks)}${Boolean(arrays.radius)}`;
    if (!this.points || this.kind !== kind) this.begin(kind, Boolean(arrays.colour), streaks);
    const geometry = this.points.geometry;
    const put = (name, array, items) => fill(geometry, name, streaks ? twice(array, items) : array, items);
    put("position", arrays.P, 3);
    if (arrays.colour) put("rgb", arrays.colour, 3);
    else put("value", arrays.value, 1);
    if (arrays.radius) put("radius", arrays.radius, 1);
    if (streaks) {
      put("velocity", arrays.v, 3);
      const tail = new Uint8Array(2 * message.shown);
      for (let i = 1; i < tail.length; i += 2) tail[i] = 1;
      fill(geometry, "tail", tail, 1, false);
    }
    geometry.setDrawRange(0, copies * message.shown);
    this.uniforms.low.value.fromArray(box[0]);
    this.uniforms.size.value.set(...box[1].map((high, k) => high - box[0][k]));
    if (arrays.radius) this.uniforms.radii.value.fromArray(message.ranges.radius);
    else this.uniforms.radii.value.set(message.radius ?? 0, message.radius ?? 0);
    this.uniforms.dots.value = this.style === "dots" ? 2 * this.renderer.getPixelRatio() : 0;
    this.uniforms.gaps.value = message.unknown?.value > 0 ? 1 : 0;
    this.uniforms.shutter.value = (message.fastest ?? 0) * this.shutter;
    this.draw();
  }

  begin(kind, coloured, streaks) {
    if (this.points) { this.scene.remove(this.points); this.points.geometry.dispose(); this.points.material.dispose(); }
    const geometry = new THREE.BufferGeometry(), material = new THREE.ShaderMaterial({
      uniforms: this.uniforms, defines: coloured ? { RGB: 1 } : {},
      vertexShader: streaks ? streakVertex : pointVertex,
      fragmentShader: streaks ? "varying vec3 tint; void main() { gl_FragColor = vec4(tint, 1.0); }" : pointFragment,
    });
    this.points = streaks ? new THREE.LineSegments(geometry, material) : new THREE.Points(geometry, material);
    this.points.frustumCulled = false;
    this.kind = kind;
    this.scene.add(this.points);
  }

  shutter = 1 / 48;

  showShapes(message) {
    for (const child of [...this.shapes.children]) this.shapes.remove(child);
    const used = new Set();
    for (const { mesh, role } of message.bodies) {
      used.add(mesh);
      if (!this.meshes.has(mesh)) {
        const geometry = new THREE.BufferGeometry();
        geometry.setAttribute("position", new THREE.BufferAttribute(message.arrays[`P${mesh}`], 3));
        geometry.setIndex(new THREE.BufferAttribute(message.arrays[`T${mesh}`], 1));
        geometry.computeVertexNormals();
        this.meshes.set(mesh, geometry);
      }
      this.shapes.add(new THREE.Mesh(this.meshes.get(mesh), this.materials[role]));
    }
    for (const [number, geometry] of this.meshes)
      if (!used.has(number)) { geometry.dispose(); this.meshes.delete(number); }
    for (const { normal, offset } of message.planes) {
      const plane = new THREE.Mesh(this.flat, this.materials.plane), n = new THREE.Vector3(...normal);
      plane.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), n);
      plane.position.copy(n.multiplyScalar(offset));
      plane.scale.setScalar(this.groundSize ?? 10);
      plane.userData.plane = true;
      this.shapes.add(plane);
    }
    this.draw();
  }

  knownMeshes() { return [...this.meshes.keys()]; }

  showTrails(message) {
    if (this.trails) { this.lines.remove(this.trails); this.trails.geometry.dispose(); this.trails = null; }
    if (message) {
      const geometry = new THREE.BufferGeometry(), ends = new THREE.InterleavedBuffer(message.arrays.ends, 4);
      geometry.setAttribute("position", new THREE.InterleavedBufferAttribute(ends, 3, 0));
      geometry.setAttribute("age", new THREE.InterleavedBufferAttribute(ends, 1, 3));
      this.trails = new THREE.LineSegments(geometry, new THREE.ShaderMaterial({
        transparent: true, depthWrite: false,
        vertexShader: `attribute float age; varying float old; void main() { old = age;
          gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`,
        fragmentShader: "varying float old; void main() { gl_FragColor = vec4(1.0, 0.7, 0.35, 0.7 * (1.0 - old)); }",
      }));
      this.trails.frustumCulled = false;
      this.lines.add(this.trails);
    }
    this.draw();
  }

  // Marks the chosen point: a cross at its position, and its path; null: none.
  mark(place, path) {
    this.marked = place;
    const set = (line, places) => {
      line.visible = places.length > 0;
      line.geometry.dispose();
      line.geometry = new THREE.BufferGeometry().setFromPoints(places.map((p) => new THREE.Vector3(...p)));
    };
    if (place) {
      const r = this.distance * 0.015, [x, y, z] = place;
      set(this.marker, [[x - r, y, z], [x + r, y, z], [x, y, z], [x, y - r, z], [x, y + r, z], [x, y, z], [x, y, z - r], [x, y, z + r]]);
    } else {
      set(this.marker, []);
    }
    set(this.path, path ?? []);
    this.draw();
  }

  // ---- the camera ----

  // Size in pixels, within the limits of pictures.
  size() {
    const edge = (x) => Math.min(Math.max(x, 16), 16384);
    return { width: edge(this.canvas.width), height: edge(this.canvas.height) };
  }

  // Looks through the scene's camera until the user moves it.
  followScene() {
    if (!this.sceneCamera) return;
    this.setCamera(this.sceneCamera);
    this.isSceneCamera = true;
  }

  // Fits everything into the picture.
  fit() {
    const box = new THREE.Box3();
    if (this.message && this.message.shown > 0)
      box.expandByPoint(new THREE.Vector3(...this.message.box[0])).expandByPoint(new THREE.Vector3(...this.message.box[1]));
    if (this.shapes.visible) for (const shape of this.shapes.children) if (!shape.userData.plane) box.expandByObject(shape);
    if (box.isEmpty()) return;
    const largest = Math.max(this.uniforms.radii.value.x, this.uniforms.radii.value.y);
    if (this.message?.shown > 0) box.expandByScalar(largest);
    this.isSceneCamera = false;
    box.getCenter(this.target);
    // Moves as near as possible with each corner still in the picture, from the current direction.
    this.place();
    this.camera.updateMatrixWorld();
    const [right, above, behind] = [0, 1, 2].map((k) => new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, k));
    const tall = Math.tan((this.camera.fov * Math.PI) / 360), wide = (tall * this.canvas.clientWidth) / (this.canvas.clientHeight || 1), half = box.getSize(new THREE.Vector3()).multiplyScalar(0.5);
    this.distance = 1e-3;
    for (const [x, y, z] of [[1, 1, 1], [1, 1, -1], [1, -1, 1], [1, -1, -1], [-1, 1, 1], [-1, 1, -1], [-1, -1, 1], [-1, -1, -1]]) {
      const corner = new THREE.Vector3(x, y, z).multiply(half);
      this.distance = Math.max(this.distance, corner.dot(behind) + 1.12 * Math.max(Math.abs(corner.dot(right)) / wide, Math.abs(corner.dot(above)) / tall));
    }
    this.lay();
    this.draw();
  }

  // Centres the marked point.
  centre() {
    if (!this.marked) return;
    this.isSceneCamera = false;
    this.target.set(...this.marked);
    this.draw();
  }

  place() {
    const flat = this.distance * Math.cos(this.tilt);
    this.camera.position.set(this.target.x + flat * Math.sin(this.turn), this.target.y + this.distance * Math.sin(this.tilt),
      this.target.z + flat * Math.cos(this.turn));
    this.camera.near = this.distance / 500;
    this.camera.far = this.distance * 50;
    this.camera.lookAt(this.target);
  }

  // Returns the camera in the format of --camera.
  cameraText() {
    this.place();
    return [...this.camera.position.toArray(), ...this.target.toArray(), this.camera.fov]
      .map((x) => Number(x.toPrecision(6))).join(",");
  }

  setCamera(numbers) {
    this.isSceneCamera = false;
    const from = new THREE.Vector3(...numbers.slice(0, 3));
    this.target.set(...numbers.slice(3, 6));
    if (numbers.length > 6) this.camera.fov = numbers[6];
    from.sub(this.target);
    this.distance = from.length();
    this.tilt = Math.asin(from.y / this.distance);
    this.turn = Math.atan2(from.x, from.z);
    this.draw();
  }

  look(turn, tilt) { this.isSceneCamera = false; this.turn = turn; this.tilt = tilt; this.draw(); }

  control() {
    const held = { button: -1 };
    this.canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.focus();
      this.canvas.setPointerCapture(event.pointerId);
      Object.assign(held, { button: event.button, x: event.clientX, y: event.clientY, moved: 0, from: [event.clientX, event.clientY],
        region: event.shiftKey && event.button === 0 });
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (held.button < 0) return;
      const dx = event.clientX - held.x, dy = event.clientY - held.y, tall = this.canvas.clientHeight;
      held.x = event.clientX;
      held.y = event.clientY;
      held.moved += Math.abs(dx) + Math.abs(dy);
      if (!held.region) this.isSceneCamera = false;
      if (held.region) return this.onregion?.([...held.from, held.x, held.y], false);
      if (held.button === 0 && !event.ctrlKey) {
        this.turn -= (dx / tall) * 4;
        this.tilt = Math.min(Math.max(this.tilt + (dy / tall) * 4, -1.55), 1.55);
      } else if (held.button === 2) {
        this.distance *= Math.exp((dy / tall) * 3);
      } else {
        const reach = 2 * this.distance * Math.tan((this.camera.fov * Math.PI) / 360) / tall;
        const right = new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, 0);
        const above = new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, 1);
        this.target.addScaledVector(right, -dx * reach).addScaledVector(above, dy * reach);
      }
      this.draw();
    });
    this.canvas.addEventListener("pointerup", (event) => {
      const { button, moved, region } = held;
      held.button = -1;
      if (region && moved > 4) return this.onregion?.([...held.from, held.x, held.y], true);
      if (button === 0 && moved <= 4) this.onpick?.(this.nearest(event.clientX, event.clientY));
    });
    this.canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.isSceneCamera = false;
      this.distance *= Math.exp(Math.sign(event.deltaY) * 0.12);
      this.draw();
    }, { passive: false });
  }

  // Returns the matrix from the world to the screen, -1 ... 1, by columns.
  matrix() {
    this.place();
    this.camera.updateMatrixWorld();
    return new THREE.Matrix4().multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse);
  }

  // Returns the row, among the points shown, of the foremost point whose disc is under the pointer; else of the one
  // with the nearest centre, up to five pixels away; -1 if there is none.
  nearest(clientX, clientY) {
    if (!this.message) return -1;
    const box = this.canvas.getBoundingClientRect(), e = this.matrix().elements, P = this.message.arrays.P;
    const [low, high] = this.message.box, scale = low.map((x, k) => (high[k] - x) / 65535);
    const radii = this.uniforms.radii.value, radius = this.message.arrays.radius;
    let found = -1, least = Infinity, under = -1, foremost = Infinity;
    for (let i = 0; i < this.message.shown; ++i) {
      const x = low[0] + P[3 * i] * scale[0], y = low[1] + P[3 * i + 1] * scale[1], z = low[2] + P[3 * i + 2] * scale[2];
      const w = e[3] * x + e[7] * y + e[11] * z + e[15];
      if (w <= 0) continue;
      const sx = (0.5 + (e[0] * x + e[4] * y + e[8] * z + e[12]) / w / 2) * box.width - (clientX - box.left);
      const sy = (0.5 - (e[1] * x + e[5] * y + e[9] * z + e[13]) / w / 2) * box.height - (clientY - box.top);
      const r = radius ? radii.x + (radii.y - radii.x) * (radius[i] / 65535) : radii.x;
      const near = Math.hypot(sx, sy);
      if (near <= (r * this.uniforms.pixels.value) / this.renderer.getPixelRatio() / w && w < foremost) { foremost = w; under = i; }
      if (near <= 5 && near < least) { least = near; found = i; }
    }
    return under >= 0 ? under : found;
  }

  draw() {
    this.onchange?.();
    if (this.due) return;
    this.due = requestAnimationFrame(() => {
      this.due = 0;
      const width = this.canvas.clientWidth, height = this.canvas.clientHeight;
      if (width === 0 || height === 0) return;
      const size = this.renderer.getSize(new THREE.Vector2());
      if (size.x !== width || size.y !== height) this.renderer.setSize(width, height, false);
      this.camera.aspect = width / height;
      this.place();
      this.camera.updateProjectionMatrix();
      this.uniforms.pixels.value = (height * this.renderer.getPixelRatio()) / 2 / Math.tan((this.camera.fov * Math.PI) / 360);
      this.uniforms.far.value = this.distance;
      this.uniforms.least.value = 3 * this.renderer.getPixelRatio();
      this.sun.position.copy(this.camera.position).add(up);
      this.renderer.render(this.scene, this.camera);
      ++this.drawn;
    });
  }
}

// Sets an attribute's values, in a buffer of the GPU that is overwritten while it is large enough: the arrays of
// messages go there unchanged.
function fill(geometry, name, array, items, normalized = true) {
  const known = geometry.getAttribute(name);
  if (known && known.room >= array.length && known.array.constructor === array.constructor) {
    known.array = array;
    known.count = array.length / items;
    known.needsUpdate = true;
    return;
  }
  const room = items * Math.ceil((1.25 * array.length) / items), larger = new array.constructor(room);
  larger.set(array);
  const made = new THREE.BufferAttribute(larger, items, normalized);
  made.room = room;
  made.usage = THREE.DynamicDrawUsage;
  made.count = array.length / items;
  geometry.setAttribute(name, made);
}

// Returns every item twice in succession.
function twice(array, items) {
  const made = new array.constructor(2 * array.length);
  for (let i = 0; i < array.length / items; ++i)
    for (let k = 0; k < items; ++k) made[(2 * i) * items + k] = made[(2 * i + 1) * items + k] = array[i * items + k];
  return made;
}
