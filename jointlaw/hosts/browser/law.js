/* The law in the page: the tables of a rock, also with other parameters, and the compiled law with the
 * state of one joint (joint.c). Units: m, Pa, J/m2. */

const FULL_STRESS = 20e6; // the largest normal stress of the tables
const INITIAL_STRESS = 10e6; // of a new joint
const DIM = 3;
const OPEN_ENDED = 1e300; // nodes.UNUSED: cells that begin there stay empty

const decoded = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

/* The parameters of a preset that the page can change */
const parametersOf = ({ a, c, mu }) => ({ a, c, mu, mating: Infinity });

/* ------------------------------------------------------------------------------------ tables */

/* Tables of a law as bytes, with access by name */
class Tables {
  constructor(bytes) {
    this.bytes = bytes.slice();
    this.view = new DataView(this.bytes.buffer);
    const whole = (name) => this.view.getInt32(JOINTLAW.numbers[name], true);
    [this.facets, this.cells, this.pieces] = ["facets", "cells", "pieces"].map(whole);
    this.blocks = Math.ceil(this.facets / JOINTLAW.lanes);
    this.depthBegin = JOINTLAW.begin + 8 * this.blocks * JOINTLAW.columns.COLUMNS * JOINTLAW.lanes;
    this.curveBegin = this.depthBegin + 8 * this.blocks * this.cells * JOINTLAW.rows.length * JOINTLAW.lanes;
  }

  number(name) { return this.view.getFloat64(JOINTLAW.numbers[name], true); }
  setNumber(name, value) { this.view.setFloat64(JOINTLAW.numbers[name], value, true); }

  /* Byte offset of a column of a facet, or of a row of one of its cells */
  place(facet, name, more = 0) {
    const { columns, lanes } = JOINTLAW, block = Math.floor(facet / lanes);
    return JOINTLAW.begin + 8 * ((block * columns.COLUMNS + columns[name] + more) * lanes + (facet % lanes));
  }
  cellPlace(facet, cell, name) {
    const { rows, lanes } = JOINTLAW, block = Math.floor(facet / lanes);
    const row = (block * this.cells + cell) * rows.length + rows.indexOf(name);
    return this.depthBegin + 8 * (row * lanes + (facet % lanes));
  }
  get(place) { return this.view.getFloat64(place, true); }
  set(place, ...values) { values.forEach((value, i) => this.view.setFloat64(place + 8 * i * JOINTLAW.lanes, value, true)); }

  /* Phi, Phi' and Phi'' of the first-loading curve at y > 0: cubic pieces of S over t */
  curve(y) {
    const eta = this.number("eta"), v = Math.sqrt(y), V = this.number("curve_scale");
    const t = v / (v + V), s = V / (v + V), n = this.pieces;
    const at = Math.min(Math.floor(t * n), n - 1), x = t * n - at;
    const c = [0, 1, 2, 3].map((i) => this.get(this.curveBegin + 8 * (4 * at + i)));
    const weight = 0.5 * t * s * n;
    const S = c[0] + x * (c[1] + x * (c[2] + x * c[3]));
    const DS = weight * (c[1] + x * (2 * c[2] + x * 3 * c[3]));
    const DDS = weight ** 2 * (2 * c[2] + 6 * x * c[3]) + 0.5 * (s - t) * DS;
    return [y ** (1 + eta) * S, y ** eta * ((1 + eta) * S + DS),
      y ** (eta - 1) * (eta * (1 + eta) * S + (1 + 2 * eta) * DS + DDS)];
  }
}

/* Tables of a rock with other a, c, mu or mating length, by the discretisation of the page "Theory";
 * closure range and numbers of nodes do not change */
function tablesOf(rock, { a, c, mu, mating }) {
  const tables = new Tables(rock.bytes), preset = parametersOf(rock);
  if (a === preset.a && c === preset.c && mu === preset.mu && mating === preset.mating) return tables.bytes;
  const M = tables.facets, old = [];
  for (let i = 0; i < M; i++) {
    const get = (name, more) => tables.get(tables.place(i, name, more));
    const theta = Math.acos(Math.min(1, get("N"))), phi = Math.atan2(get("E", 1), get("E"));
    old.push({ u: Math.cos(preset.a * theta), phi, c1: get("COS_THETA"), share: get("WEIGHT"), A: get("A") });
  }
  const eta = tables.number("eta"), soft = tables.number("stiffness_ratio"), shares = ringShares(tables, old);
  const whole = old.findIndex((f) => f.share > 0);
  const unit = old[whole].A / (old[whole].share * old[whole].c1 ** (1 + eta)); // N lam K
  const facets = old.map(({ u, phi }, i) => {
    const density = 1 + 0.5 * rock.b * (3 * u * u - 1), theta = Math.acos(Math.min(1, u)) / a;
    const lean = Math.max(-1, Math.min(1, (3 * c * (1 - u * u)) / density));
    const share = Math.max(0, shares[i] * (1 + lean * Math.cos(2 * phi))), c1 = Math.cos(theta);
    return { theta, phi, share, c1, steep: Math.tan(theta), A: unit * share * c1 ** (1 + eta) };
  });
  facets.forEach((f, i) => setFacet(tables, i, f, mu, soft));
  if (tables.cells > 1) setCells(tables, rock.range, facets);
  tables.setNumber("mu", mu);
  tables.setNumber("mating_length", Math.min(mating, Number.MAX_VALUE));
  tables.view.setInt32(JOINTLAW.numbers.interlock_decays, mating < Infinity ? 1 : 0, true);
  const carried = ({ A, theta, steep }) => A * (Math.cos(theta) + Math.sin(theta) * Math.min(steep * soft, mu));
  tables.setNumber("normal_stress_factor", facets.reduce((sum, f) => sum + carried(f), 0));
  tables.setNumber("closure_per_displacement", 1 + 2 * Math.max(1, ...facets.map((f) => f.steep)));
  return tables.bytes;
}

/* Weight of each facet without c: the mean over its inclination, because c sums to zero over it */
function ringShares(tables, facets) {
  return facets.map((f, i) => {
    const ring = facets.filter((other) => Math.abs(other.u - f.u) < 1e-9);
    return ring.reduce((sum, other) => sum + other.share, 0) / tables.get(tables.place(i, "RING_SIZE"));
  });
}

function setFacet(tables, i, { theta, phi, share, c1, steep, A }, mu, soft) {
  const set = (name, ...values) => tables.set(tables.place(i, name), ...values);
  const st = Math.sin(theta), cp = Math.cos(phi), sp = Math.sin(phi);
  set("M", 1, (st * cp) / c1, (st * sp) / c1);
  set("S", -st, c1 * cp, c1 * sp);
  set("N", c1, st * cp, st * sp);
  set("TAN_THETA", steep);
  set("COS_THETA", c1);
  set("A", A);
  set("SHEAR_STIFFNESS", A / c1);
  set("FRICTION_LIMIT", (mu / soft) * A);
  set("SLIDER_COMPLIANCE", A > 0 ? (c1 * soft) / (2 * A) : 0);
  set("ENERGY_FACTOR", A * c1);
  set("WEIGHT", share);
}

const GRID = 512;

/* Linear interpolation of ys at x; xs increase */
function interpolated(x, xs, ys) {
  let at = 1;
  while (at < xs.length - 1 && xs[at] < x) at++;
  const share = (x - xs[at - 1]) / (xs[at] - xs[at - 1]);
  return ys[at - 1] + Math.max(0, Math.min(1, share)) * (ys[at] - ys[at - 1]);
}

/* Limits of the cells of all facets, and the numbers that the law stores of them */
function setCells(tables, range, facets) {
  const low = (i, j) => tables.get(tables.cellPlace(i, j, "ZETA_START"));
  const counts = facets.map((_, i) => Array.from({ length: tables.cells }, (_, j) => low(i, j)).filter((z) => z < OPEN_ENDED).length);
  const far = Math.max(1, Math.min(2, Math.max(...counts) / 8)); // many cells reach farther
  const reach = facets.map((f) => range * (1 + far * Math.min(f.steep, 10)));
  const edges = Array.from({ length: GRID + 1 }, (_, i) => Math.max(...reach) * (i / GRID) ** 4);
  const middle = edges.slice(1).map((edge, i) => tables.curve(0.5 * (edge + edges[i])));
  const bend = Math.max(...middle.map((m) => m[2])), force = middle.at(-1)[0], end = tables.curve(edges.at(-1))[0];
  const shares = middle.map(([phi, , curved], i) => {
    const density = Math.sqrt(Math.max(curved, 0) / bend) * (phi / force) ** -0.15 * Math.max(phi / end, 1) ** (0.15 - 0.5);
    return isFinite(density) ? density * (edges[i + 1] - edges[i]) : 0;
  });
  const sum = shares.reduce((x, y) => x + y, 0), total = [0];
  shares.forEach((share, i) => total.push(total[i] + share / sum + (1e-6 * (edges[i + 1] - edges[i])) / edges.at(-1)));
  facets.forEach((_, i) => {
    const all = interpolated(reach[i], edges, total);
    const begins = [0];
    for (let j = 1; j < counts[i]; j++) begins.push(interpolated((all * j) / (counts[i] - 1 + 1.8), total, edges));
    const at = begins.map((z) => (z ? tables.curve(z) : [0, 0]));
    begins.forEach((z, j) => {
      const put = (name, value) => tables.set(tables.cellPlace(i, j, name), value);
      put("ZETA_START", z), put("PHI_START", at[j][0]), put("DPHI_START", at[j][1]);
      if (j === counts[i] - 1) return; // the last cell has no end
      const next = begins[j + 1], [phi, slope] = at[j + 1];
      put("ZETA_END", next), put("G_END", phi - at[j][0] - at[j][1] * (next - z)), put("KAPPA_END", slope - at[j][1]);
    });
  });
}

/* ------------------------------------------------------------------------------------- a joint */

class Joint {
  /* exports: functions of joint.wasm; bytes: tables of a law. Joints share the memory of the module:
   * only the last one is valid */
  constructor(exports, bytes) {
    this.wasm = exports;
    const begin = exports.bytes();
    const room = begin + 2 * bytes.length + (1 << 16) - exports.memory.buffer.byteLength;
    if (room > 0) exports.memory.grow(Math.ceil(room / (1 << 16)));
    new Uint8Array(exports.memory.buffer, begin).set(bytes);
    let free = exports.load_law();
    const numbers = (n) => new Float64Array(exports.memory.buffer, (free += 8 * n) - 8 * n, n);
    const size = exports.state_size();
    this.facets = exports.facet_count();
    this.cells = exports.cell_count();
    this.state = numbers(size);
    this.next = numbers(size);
    this.d = numbers(DIM);
    this.out = numbers(DIM + DIM * DIM); // F and C of the last trial
    this.facetSize = 5 + 2 * this.cells; // numbers per facet that evaluate_facets writes
    this.facetBuffer = numbers(this.facets * this.facetSize);
    this.messageBytes = new Uint8Array(exports.memory.buffer, free, 300);
    this.length = exports.closure_at(INITIAL_STRESS); // m, characteristic: closure of the joint at 10 MPa
    this.reset();
  }

  reset() {
    this.state.fill(0);
    this.F = [0, 0, 0];
  }

  snapshot() { return { state: this.state.slice(), F: this.F }; }

  restore({ state, F }) {
    this.state.set(state);
    this.F = F;
  }

  /* Traction after a trial step, which `commit` accepts */
  trial(d) {
    this.d.set(d);
    const { state, next, out, messageBytes } = this;
    const failed = this.wasm.update(
      state.byteOffset, next.byteOffset, this.d.byteOffset, out.byteOffset, messageBytes.byteOffset,
    );
    if (failed) throw new Error(new TextDecoder().decode(messageBytes.subarray(0, messageBytes.indexOf(0))));
    return out;
  }

  commit() {
    this.state.set(this.next);
    this.F = Array.from(this.out.subarray(0, DIM));
  }

  /* Closure increment at which a step with this shear ends at a normal stress: Newton's method with a
   * bracket. That step is then the last trial. */
  closing(shear, stress) {
    let low = -Infinity, high = Infinity, u = 0, reach = 0.01 * this.length;
    for (let tries = 0; tries < 100; tries++) {
      const out = this.trial([u, ...shear]);
      const residual = out[0] - stress;
      if (Math.abs(residual) <= 1e-9 * Math.max(stress, 1e-3 * INITIAL_STRESS)) break;
      if (residual < 0) low = u;
      else high = u;
      const newton = u - residual / out[DIM], far = residual < 0 ? u + reach : u - reach;
      if (isFinite(high - low)) u = newton > low && newton < high ? newton : (low + high) / 2;
      else u = Math.abs(newton - u) < reach ? newton : far;
      reach *= 2;
    }
    return u;
  }

  get stored() { return this.wasm.stored(this.state.byteOffset); }
  get dissipated() { return this.wasm.dissipated(this.state.byteOffset); }

  /* Present state of the facets: normal, load, sliding fraction, gap and utilisation of its cells */
  facetStates() {
    this.wasm.evaluate_facets(this.state.byteOffset, this.facetBuffer.byteOffset);
    return Array.from({ length: this.facets }, (_, i) => {
      const row = this.facetBuffer.subarray(i * this.facetSize, (i + 1) * this.facetSize);
      const cells = Array.from({ length: this.cells }, (_, j) => ({ gap: row[5 + 2 * j], use: row[6 + 2 * j] }));
      return { n: Array.from(row.subarray(0, 3)), load: row[3], slides: row[4], cells };
    });
  }
}
