/* A joint in your browser. Joint: the law (joint.c) and the state of one joint. Test: what is done
 * with it, and the rows of what came out. Then pictures and controls. All in m, Pa and J/m2. */
"use strict";

const HERE = document.currentScript.src.replace(/[^/]*$/, "");
const FULL_STRESS = 20e6; // the largest normal stress, to which the tables of the rocks reach
const SEAT = 10e6; // of a joint that begins
const DIM = 3;
const part = (name) => document.getElementById(`joint-${name}`);

// ------------------------------------------------------------------------------------ the law

const decoded = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

class Joint {
  static async of(preset, resolution) {
    const key = `${preset}-${resolution}`;
    if (!JOINTLAW[key]) await loadScript(`${HERE}${key}.js`);
    const { instance } = await WebAssembly.instantiate(decoded(JOINTLAW.wasm), {});
    return new Joint(instance.exports, decoded(JOINTLAW[key]));
  }

  constructor(wasm, tables) {
    this.wasm = wasm;
    const begin = wasm.bytes();
    const room = begin + 2 * tables.length + (1 << 16) - wasm.memory.buffer.byteLength;
    if (room > 0) wasm.memory.grow(Math.ceil(room / (1 << 16)));
    new Uint8Array(wasm.memory.buffer, begin).set(tables);
    let free = wasm.take_law();
    const numbers = (n) => new Float64Array(wasm.memory.buffer, (free += 8 * n) - 8 * n, n);
    const size = wasm.state_size();
    this.facets = wasm.facet_count();
    this.cells = wasm.cell_count();
    this.state = numbers(size);
    this.next = numbers(size);
    this.d = numbers(DIM);
    this.out = numbers(DIM + DIM * DIM); // F and C of the last trial
    this.seen = numbers(this.facets * (5 + 2 * this.cells));
    this.words = new Uint8Array(wasm.memory.buffer, free, 300);
    this.F = [0, 0, 0];
    this.length = wasm.closure_at(SEAT); // of the joint: its closure at 10 MPa
  }

  reset() {
    this.state.fill(0);
    this.F = [0, 0, 0];
  }

  /* The traction after a step, which `keep` would take */
  trial(d) {
    this.d.set(d);
    const { state, next, out, words } = this;
    const failed = this.wasm.update(
      state.byteOffset, next.byteOffset, this.d.byteOffset, out.byteOffset, words.byteOffset,
    );
    if (failed) throw new Error(new TextDecoder().decode(words.subarray(0, words.indexOf(0))));
    return out;
  }

  keep() {
    this.state.set(this.next);
    this.F = Array.from(this.out.subarray(0, DIM));
  }

  /* The closure increment with which this shear ends at a normal stress: Newton's method, kept in
   * a bracket. Leaves that step as the last trial. */
  closing(shear, stress) {
    let low = -Infinity, high = Infinity, u = 0, reach = 0.01 * this.length;
    for (let tries = 0; tries < 100; tries++) {
      const out = this.trial([u, ...shear]);
      const miss = out[0] - stress;
      if (Math.abs(miss) <= 1e-9 * Math.max(stress, 1e-3 * SEAT)) break;
      if (miss < 0) low = u;
      else high = u;
      const newton = u - miss / out[DIM], far = miss < 0 ? u + reach : u - reach;
      if (isFinite(high - low)) u = newton > low && newton < high ? newton : (low + high) / 2;
      else u = Math.abs(newton - u) < reach ? newton : far;
      reach *= 2;
    }
    return u;
  }

  get stored() { return this.wasm.stored(this.state.byteOffset); }
  get dissipated() { return this.wasm.dissipated(this.state.byteOffset); }

  /* Facets now: normal, load, share of the friction that slides, and of its cells gap and use */
  look() {
    this.wasm.look(this.state.byteOffset, this.seen.byteOffset);
    const wide = 5 + 2 * this.cells;
    return Array.from({ length: this.facets }, (_, i) => {
      const row = this.seen.subarray(i * wide, (i + 1) * wide);
      const cells = Array.from({ length: this.cells }, (_, j) => ({ gap: row[5 + 2 * j], use: row[6 + 2 * j] }));
      return { n: Array.from(row.subarray(0, 3)), load: row[3], slides: row[4], cells };
    });
  }
}

function loadScript(address) {
  return new Promise((done, failed) => {
    const script = document.createElement("script");
    script.src = address;
    script.onload = done;
    script.onerror = () => failed(new Error(`${address} cannot be loaded`));
    document.head.append(script);
  });
}

// -------------------------------------------------------------------------------------- a test

class Test {
  constructor(joint, degrees) {
    const angle = (degrees * Math.PI) / 180;
    this.joint = joint;
    this.along = [Math.cos(angle), Math.sin(angle)];
    this.virgin = (joint.reset(), joint.look());
    this.steps = []; // (d, F) of each step, as the law took and gave them
    this.rows = [];
    this.slip = this.closure = this.work = 0;
  }

  /* Take the last trial of the joint */
  take(slip) {
    const { joint } = this;
    const d = Array.from(joint.d), before = joint.F;
    joint.keep();
    const F = joint.F;
    for (let i = 0; i < DIM; i++) this.work += 0.5 * (before[i] + F[i]) * d[i];
    this.slip += slip;
    this.closure += d[0];
    this.steps.push([...d, ...F]);
    const shear = F[1] * this.along[0] + F[2] * this.along[1];
    this.rows.push({ slip: this.slip, closure: this.closure, normal: F[0], shear });
    if (this.rows.length > 6000) this.rows.splice(0, 1500);
  }

  /* Slip by so much while the normal stress stays */
  slipAt(stress, slip) {
    this.joint.closing(this.along.map((e) => e * slip), stress);
    this.take(slip);
  }

  /* Move by so much, closure and slip */
  move(closure, slip) {
    this.joint.trial([closure, ...this.along.map((e) => e * slip)]);
    this.take(slip);
  }
}

/* Steps of the tests that can be played: each yields after one step */
const PLAYED = {
  *closure(test, level) {
    for (const [from, to] of [[0, 1], [1, 0], [0, 1], [1, 0]])
      for (let i = 1; i <= 80; i++) yield test.slipAt(level * (from + ((to - from) * i) / 80) ** 2, 0);
  },
  *shear(test, level) {
    yield* seat(test, level);
    yield* slide(test, level, 6);
  },
  *cycle(test, level) {
    yield* seat(test, level);
    for (const way of [3, -6, 6, -6, 6]) yield* slide(test, level, way);
  },
  *opening(test, level) {
    yield* seat(test, level);
    yield* slide(test, level, 2);
    const step = test.joint.length / 50;
    while (test.joint.F[0] > 0) yield test.move(-step, 0);
    for (let i = 0; i < 25; i++) yield test.move(-step, 0);
    while (test.joint.trial([step, 0, 0])[0] < level) yield test.take(0);
    yield test.slipAt(level, 0);
  },
};

function* seat(test, level) {
  for (let i = 1; i <= 40; i++) yield test.slipAt(level * (i / 40) ** 2, 0);
}

function* slide(test, level, way) {
  const count = Math.round(50 * Math.abs(way)), slip = (way * test.joint.length) / count;
  for (let i = 0; i < count; i++) yield test.slipAt(level, slip);
}

// ------------------------------------------------------------------------------------ pictures

let colours = {};

/* A canvas made ready for one picture, in CSS pixels */
function canvas(name) {
  const place = part(name), ratio = window.devicePixelRatio || 1;
  const wide = place.clientWidth, high = place.clientHeight;
  const c = place.getContext("2d"), pixels = [wide, high].map((size) => Math.round(size * ratio));
  if (place.width !== pixels[0] || place.height !== pixels[1]) [place.width, place.height] = pixels;
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  c.clearRect(0, 0, wide, high);
  c.font = "12px system-ui, sans-serif";
  c.lineJoin = "round";
  return { c, wide, high };
}

/* Colours of the theme, which can change while the page is open */
function readColours() {
  for (const name of ["ink", "faint", "line", "rock", "over", "stuck", "sliding", "apart"]) {
    part("probe").style.color = `var(--${name})`;
    colours[name] = getComputedStyle(part("probe")).color;
  }
}

function niceStep(range, most) {
  const rough = range / most, power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((s) => s * power >= rough);
}

const tidy = (x, step) => (Math.abs(x) < step / 2 ? 0 : x).toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));

/* Lines against one another. lines: { x, y, colour, name } of numbers in the units of the labels;
 * smallest: range of each axis */
function plot(name, xLabel, yLabel, lines, smallest) {
  const { c, wide, high } = canvas(name);
  const bounds = (key, least) => {
    let [low, high] = [Infinity, -Infinity];
    for (const line of lines) for (const v of line[key]) (low = Math.min(low, v)), (high = Math.max(high, v));
    const more = Math.max(0.04 * (high - low), (least - (high - low)) / 2);
    return [low - more, high + more];
  };
  const [x0, x1] = bounds("x", smallest[0]), [y0, y1] = bounds("y", smallest[1]);
  const xStep = niceStep(x1 - x0, wide / 60), yStep = niceStep(y1 - y0, high / 40);
  const left = 46, right = wide - 10, top = 24, bottom = high - 36;
  const X = (x) => left + ((right - left) * (x - x0)) / (x1 - x0);
  const Y = (y) => bottom - ((bottom - top) * (y - y0)) / (y1 - y0);
  c.fillStyle = colours.ink;
  c.strokeStyle = colours.line;
  c.lineWidth = 0.5;
  c.textBaseline = "top";
  c.textAlign = "center";
  for (let x = Math.ceil(x0 / xStep) * xStep; x <= x1 + 1e-9 * xStep; x += xStep) {
    c.strokeRect(X(x), top, 0, bottom - top);
    c.fillText(tidy(x, xStep), X(x), bottom + 4);
  }
  c.fillText(xLabel, (left + right) / 2, bottom + 20);
  c.textBaseline = "middle";
  c.textAlign = "right";
  for (let y = Math.ceil(y0 / yStep) * yStep; y <= y1 + 1e-9 * yStep; y += yStep) {
    c.strokeRect(left, Y(y), right - left, 0);
    c.fillText(tidy(y, yStep), left - 5, Y(y));
  }
  c.textAlign = "left";
  let at = 4;
  for (const line of [...lines, { name: yLabel, colour: colours.ink, x: [] }]) {
    c.fillStyle = line.colour; // the label of the vertical axis, in the colours of its lines
    c.fillText(line.name, at, 10);
    at += c.measureText(line.name).width + 5;
    c.strokeStyle = c.fillStyle = line.colour;
    c.lineWidth = 1.5;
    c.beginPath();
    line.x.forEach((x, i) => c.lineTo(X(x), Y(line.y[i])));
    c.stroke();
    if (line.x.length) c.fillRect(X(line.x.at(-1)) - 4, Y(line.y.at(-1)) - 4, 8, 8);
  }
}

/* Facets by azimuth and inclination: colour tells the state, strength of colour the load */
function drawRose(test, facets) {
  const { c, wide, high } = canvas("rose");
  const R = Math.min(wide, high - 20) / 2 - 18, x = wide / 2, y = high / 2 + 10;
  const angle = (n) => (Math.acos(Math.min(1, n[0])) * 180) / Math.PI;
  const rings = [...new Set(facets.map((f) => angle(f.n).toFixed(6)))].map(Number).sort((a, b) => a - b);
  const edges = rings.map((t, i) => (i ? (t + rings[i - 1]) / 2 : 0));
  edges.push(2 * rings.at(-1) - edges.at(-1));
  const most = Math.max(...facets.map((f) => f.load), 1e-300);
  rings.forEach((t, i) => {
    const ring = facets.filter((f) => Math.abs(angle(f.n) - t) < 1e-5), half = Math.PI / ring.length;
    for (const f of ring) {
      const at = -Math.atan2(f.n[2], f.n[1]);
      c.beginPath();
      c.arc(x, y, (R * edges[i + 1]) / edges.at(-1), at - half, at + half);
      c.arc(x, y, (R * edges[i]) / edges.at(-1), at + half, at - half, true);
      c.closePath();
      if (f.load > 0) {
        c.globalAlpha = 0.2 + (0.8 * f.load) / most;
        c.fillStyle = f.slides > 0.5 ? colours.sliding : colours.stuck;
        c.fill();
        c.globalAlpha = 1;
      }
      c.strokeStyle = colours.line;
      c.stroke();
    }
  });
  c.fillStyle = c.strokeStyle = colours.ink;
  c.textBaseline = "middle";
  c.textAlign = "left";
  c.fillText(`facets, inclined by 0 to ${Math.round(edges.at(-1))}°`, 4, 10);
  c.translate(x, y); // an arrow: the way that the upper block is dragged
  c.rotate(-Math.atan2(test.along[1], test.along[0]));
  c.fillText("►", R + 3, 1);
}

/* Which asperities stand for the joint in the picture: pairs of facets of one ring that face
 * against the slip and with it, and cells of all depths. gap: before the joint was closed */
function chooseTeeth(test, count) {
  const [ex, ey] = test.along, { virgin, joint } = test;
  const tilts = virgin.map((f) => Math.atan2(f.n[1] * ex + f.n[2] * ey, f.n[0]));
  const flat = virgin.map((f) => Math.abs(f.n[2] * ex - f.n[1] * ey));
  const order = tilts.map((_, i) => i).filter((i) => flat[i] < 0.6 * Math.abs(Math.sin(tilts[i])) + 0.05);
  const up = order.filter((i) => tilts[i] > 0).sort((a, b) => tilts[a] - tilts[b]);
  const down = order.filter((i) => tilts[i] < 0).sort((a, b) => tilts[b] - tilts[a]);
  return Array.from({ length: count }, (_, j) => {
    const side = j % 2 ? down : up, facet = side[((j >> 1) * 2 + (j >> 2)) % side.length];
    const near = virgin[facet].cells.filter((cell) => cell.gap < 1.5 * joint.length).length || 1;
    const cell = (j * 3 + (j >> 1)) % near;
    return { facet, cell, tilt: tilts[facet], gap: virgin[facet].cells[cell].gap };
  });
}

/* The two profiles. Faces have the inclination of their facets; the gap between two of them, their
 * slip and closure are those of the law, enlarged `zoom` times */
function drawScene(test, facets) {
  const { c, wide, high } = canvas("scene");
  const count = 2 * Math.round(wide / 90), zoom = zoomOf(test);
  const teeth = chooseTeeth(test, count), pitch = (wide + 200) / count, half = pitch / 2;
  let x = -100 + half, z = 0;
  const faces = teeth.map((tooth) => { // ends of the lower face, height upward
    const rise = half * Math.tan(tooth.tilt);
    const face = { ...tooth, x0: x - half, z0: z, x1: x + half, z1: z + 2 * rise };
    x += pitch;
    z += 2 * rise;
    return face;
  });
  const middle = faces.reduce((sum, f) => sum + f.z0 + f.z1, 0) / (2 * count);
  const base = high * 0.56 + middle;
  const moved = (f, shrink) => { // the upper face
    const gap = f.gap * zoom, dx = -Math.sin(f.tilt) * gap + test.slip * zoom;
    const dz = Math.cos(f.tilt) * gap - test.closure * zoom, sx = shrink * (f.x1 - f.x0), sz = shrink * (f.z1 - f.z0);
    return [[f.x0 + sx + dx, f.z0 + sz + dz], [f.x1 - sx + dx, f.z1 - sz + dz]];
  };
  const rock = (points, edge, colour) => {
    c.beginPath();
    points.forEach(([px, pz]) => c.lineTo(px, base - pz));
    c.lineTo(points.at(-1)[0], edge);
    c.lineTo(points[0][0], edge);
    c.closePath();
    c.fillStyle = colour;
    c.fill();
    c.strokeStyle = colours.faint;
    c.lineWidth = 1;
    c.stroke();
  };
  rock(faces.flatMap((f) => [[f.x0, f.z0], [f.x1, f.z1]]), high + 2, colours.rock);
  rock(faces.flatMap((f) => moved(f, 0.12)), -2, colours.over);
  c.lineWidth = 4;
  c.lineCap = "round";
  for (const f of faces) {
    const cell = facets[f.facet].cells[f.cell];
    c.strokeStyle = cell.gap >= 0 ? colours.apart : cell.use >= 1 ? colours.sliding : colours.stuck;
    const [from, to] = moved(f, 0.2);
    c.beginPath();
    c.moveTo(from[0], base - from[1]);
    c.lineTo(to[0], base - to[1]);
    c.stroke();
  }
  c.fillStyle = colours.ink;
  c.textAlign = "center";
  c.textBaseline = "middle";
  c.fillText("◄ drag this block ►", wide / 2 + test.slip * zoom, 16);
  const [per, unit] = scale(test.joint.length), bar = niceStep((100 / zoom) * per, 1);
  c.fillRect(12, high - 14, (bar / per) * zoom, 3); // of the displacements
  c.textAlign = "left";
  c.fillText(`${three(bar)} ${unit}`, 12, high - 24);
}

/* Pixels for one metre in the scene */
const zoomOf = (test) => Math.min(14, part("scene").clientWidth / 50) / test.joint.length;

// ----------------------------------------------------------------------------------- the page

let test, level, playing = null, drawn = false;

const scale = (length) => length >= 1e-4 ? [1e3, "mm"] : length >= 5e-8 ? [1e6, "µm"] : [1e9, "nm"];
const three = (x) => (Math.abs(x) < 1e-12 ? "0" : Number(x.toPrecision(3)).toString());

function joules(x) {
  return Math.abs(x) >= 1e3 ? `${three(x / 1e3)} kJ/m²` : `${three(x)} J/m²`;
}

function draw() {
  drawn = false;
  readColours();
  const { rows, joint } = test, [per, unit] = scale(joint.length), facets = joint.look();
  const column = (key, factor) => rows.map((row) => row[key] * factor);
  const slip = column("slip", per), closure = column("closure", per), few = joint.length * per;
  const normal = { y: column("normal", 1e-6), colour: colours.faint, name: "normal" };
  const shear = { x: slip, y: column("shear", 1e-6), colour: colours.sliding, name: "shear" };
  const slipLabel = `slip (${unit})`, closureLabel = `closure (${unit})`;
  const seated = Math.max(0, rows.findIndex((row) => row.slip)); // the first row with slip
  const dilation = { x: slip.slice(seated), y: closure.slice(seated), colour: colours.stuck, name: closureLabel };
  drawScene(test, facets);
  plot("stress", slipLabel, "stress (MPa)", [{ ...normal, x: slip }, shear], [few, 0.1]);
  plot("closure", slipLabel, "", [dilation], [few, 0.1 * few]);
  plot("normal", closureLabel, "", [{ ...normal, x: closure, colour: colours.ink, name: "normal stress (MPa)" }], [0.1 * few, 0.1]);
  drawRose(test, facets);
  tell(per, unit);
}

function tell(per, unit) {
  const { joint } = test, last = test.rows.at(-1);
  part("told").textContent = `normal stress ${three(last.normal / 1e6)} MPa, shear stress ${three(last.shear / 1e6)} MPa, `
    + `closure ${three(test.closure * per)} ${unit}, slip ${three(test.slip * per)} ${unit}`;
  const stored = joint.stored, lost = joint.dissipated, all = Math.max(test.work, stored + lost, 1e-300);
  part("put").textContent = joules(test.work);
  part("kept").textContent = `${joules(stored)}, ${joules(lost)}`;
  for (const [name, share] of [["put", test.work], ["stored", stored], ["lost", lost]])
    part(`${name}-bar`).style.width = `${Math.max(0, (100 * share) / all)}%`;
  const held = part("hold").value === "stress";
  part("level-name").textContent = held ? "Normal stress" : "Closure";
  part("level").value = held ? (400 * level) / FULL_STRESS : (200 * test.closure) / joint.length;
  part("level-told").textContent = held ? `${three(level / 1e6)} MPa` : `${three(test.closure * per)} ${unit}`;
  part("direction-told").textContent = `${part("direction").value}°`;
}

function redraw() {
  if (drawn || !test) return; // nothing to draw while the first tables load
  drawn = true;
  requestAnimationFrame(draw);
}

/* Move the upper block: in steps so small that the path of the mouse, not its speed, decides */
function drag(slip, closure) {
  playing = null;
  const held = part("hold").value === "stress", finest = test.joint.length / 100;
  const size = held ? Math.abs(slip) : Math.hypot(slip, closure), count = Math.ceil(size / finest);
  guarded(() => {
    for (let i = 0; i < count; i++) {
      if (held) test.slipAt(level, slip / count);
      else test.move(closure / count, slip / count);
    }
  });
}

/* Go to a normal stress or a closure, of 0 to 1, at this slip */
function setLevel(share) {
  playing = null;
  guarded(() => {
    if (part("hold").value === "closure") return drag(0, 2 * share * test.joint.length - test.closure);
    const from = test.joint.F[0];
    level = Math.max(share, 0.005) * FULL_STRESS;
    for (let i = 1; i <= 20; i++) test.slipAt(from + ((level - from) * i) / 20, 0);
  });
}

/* Do it and draw; a step that the law refuses tells its reason and changes nothing */
function guarded(what) {
  try {
    what();
    redraw();
  } catch (error) {
    playing = null;
    draw();
    part("told").textContent = error.message;
  }
}

function play(name) {
  const began = (test = new Test(test.joint, part("direction").value));
  const steps = (PLAYED[name] || seat)(test, level);
  playing = steps;
  const advance = () => {
    if (playing !== steps || began !== test) return;
    guarded(() => {
      for (let i = 0; i < (name ? 2 : 40); i++) if (steps.next().done) playing = null;
    });
    requestAnimationFrame(advance);
  };
  advance();
}

async function begin() {
  playing = null;
  const joint = await Joint.of(part("preset").value, part("resolution").value);
  level = level || SEAT;
  test = { joint };
  play("");
}

function listen() {
  for (const name of JOINTLAW.presets) part("preset").add(new Option(name));
  for (const name of JOINTLAW.resolutions) part("resolution").add(new Option(name));
  part("preset").value = "westerly-rough";
  part("resolution").value = "balanced";
  for (const name of ["preset", "resolution"]) part(name).onchange = begin;
  part("direction").oninput = () => play("");
  part("hold").onchange = () => ((level = Math.max(test.joint.F[0], 1e5)), redraw());
  part("level").oninput = () => setLevel(part("level").value / 400);
  for (const button of document.querySelectorAll("#joint button")) button.onclick = () => play(button.dataset.test);
  const scene = part("scene"), ways = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  let from = null;
  scene.onpointerdown = (event) => {
    from = event;
    scene.setPointerCapture(event.pointerId);
  };
  scene.onpointermove = (event) => {
    if (!from) return;
    drag((event.clientX - from.clientX) / zoomOf(test), (event.clientY - from.clientY) / zoomOf(test));
    from = event;
  };
  scene.onpointerup = scene.onpointercancel = () => (from = null);
  scene.onkeydown = (event) => {
    const way = ways[event.key];
    if (!way) return;
    event.preventDefault();
    drag((way[0] * test.joint.length) / 20, (way[1] * test.joint.length) / 20);
  };
  window.addEventListener("resize", redraw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  new MutationObserver(redraw).observe(document.body, { attributeFilter: ["data-theme"] });
}

listen();
begin();
