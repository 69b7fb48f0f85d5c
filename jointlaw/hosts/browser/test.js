/* A test of a joint: its loading path, the resulting rows, and both as text. */

const REACH = 7; // largest slip in the picture, in closures at 10 MPa
const OPENING = 3; // largest opening, in the same unit
const MAX_STEP = 1 / 100; // step in the same unit: results must not depend on the speed of the pointer
const MOST_ROWS = 6000;
const MOST_LEGS = 60; // stored in the address

class Test {
  constructor(joint) {
    this.joint = joint;
    this.hold = "stress"; // or "closure"
    this.level = 0; // Pa, prescribed normal stress
    this.at = [0, 0, 0]; // closure and slip along axes 2 and 3
    this.rows = [];
    this.legs = []; // loading path: see `log`
    this.turns = 0; // number of changes of direction
    this.message = ""; // reason for a stop
    joint.reset();
    this.virgin = joint.facetStates();
    this.turn(0);
  }

  /* Set the direction of slip, from axis 2 towards axis 3; the state of the joint does not change */
  turn(degrees) {
    const angle = (degrees * Math.PI) / 180;
    if (degrees !== this.degrees && this.rows.length) this.turns++;
    this.degrees = degrees;
    this.along = [Math.cos(angle), Math.sin(angle)];
  }

  get slip() { return this.at[1] * this.along[0] + this.at[2] * this.along[1]; }
  get closure() { return this.at[0]; }
  get isOpen() { return this.joint.F[0] <= 0; }

  /* Accept the last trial of the joint. Returns false and sets a message if it would leave the picture or
   * the tables */
  accept(hold, level) {
    const { joint } = this, d = Array.from(joint.d), at = this.at.map((x, i) => x + d[i]);
    const far = Math.hypot(at[1], at[2]), before = Math.hypot(this.at[1], this.at[2]);
    if (joint.out[0] > FULL_STRESS * 1.001 && joint.out[0] > joint.F[0])
      this.message = "The tables of this rock end at 20 MPa; the block stops here.";
    else if (far > REACH * joint.length && far > before)
      this.message = "The picture ends here. Slide back, or start a new joint.";
    else if (at[0] < -OPENING * joint.length && d[0] < 0)
      this.message = "The joint is wide open. Move the block down again.";
    else {
      this.log({ hold, level, d, steps: 1, from: joint.F[0] });
      joint.commit();
      this.at = at;
      const { F } = joint, shear = F[1] * this.along[0] + F[2] * this.along[1];
      const row = { d, F, at, slip: this.slip, closure: at[0], normal: F[0], shear, turn: this.turns };
      this.rows.push(row);
      if (this.rows.length > MOST_ROWS) this.rows.splice(0, MOST_ROWS / 4);
      return true;
    }
    return false;
  }

  /* Combine steps of one kind and direction to a leg: { hold, level, d (3), steps, from (Pa) } */
  log(leg) {
    const last = this.legs.at(-1), slips = (one) => Math.hypot(one.d[1], one.d[2]) > 0;
    const size = (v) => Math.hypot(...v);
    const same = (from) => {
      const [p, q] = [last.d.slice(from), leg.d.slice(from)];
      return p.reduce((sum, x, i) => sum + x * q[i], 0) > (1 - 1e-12) * size(p) * size(q);
    };
    const goesOn = last && last.hold === leg.hold && (leg.hold === "closure" ? same(0)
      : slips(last) === slips(leg) && (slips(leg) ? last.level === leg.level && same(1)
        : (leg.level - last.level) * (last.level - last.from) >= 0));
    if (!goesOn) this.legs.push(leg);
    else Object.assign(last, { level: leg.level, steps: last.steps + 1, d: last.d.map((x, i) => x + leg.d[i]) });
    if (this.legs.length > 10 * MOST_LEGS) this.legs.shift(), (this.isShort = true);
  }

  /* Load to a normal stress without slip; an open joint closes first. This and the following functions
   * are generators that yield after each step */
  *press(level) {
    const { joint } = this, step = joint.length / 50;
    this.message = "";
    while (level > 0 && this.isOpen && joint.trial([step, 0, 0])[0] === 0)
      if (this.accept("closure", 0)) yield;
      else return;
    const from = joint.F[0], count = from < 0.1 * level ? 40 : 20;
    for (let i = 1; i <= count && level !== from; i++) {
      const share = (i / count) ** (count === 40 ? 2 : 1), stress = from + (level - from) * share;
      joint.closing([0, 0], stress);
      if (!this.accept("stress", stress)) return;
      this.level = stress;
      yield;
    }
    this.level = level;
  }

  /* Slip in the direction, at the prescribed normal stress or closure */
  *slide(slip, steps = Math.ceil(Math.abs(slip) / (MAX_STEP * this.joint.length) - 1e-9)) {
    const d = this.along.map((e) => (e * slip) / steps);
    this.message = "";
    for (let i = 0; i < steps; i++) {
      if (this.hold === "stress") this.joint.closing(d, this.level);
      else this.joint.trial([0, ...d]);
      if (!this.accept(this.hold, this.level)) return;
      yield;
    }
  }

  /* Prescribe increments of closure and slip */
  *move(closure, slip) {
    const steps = Math.ceil(Math.hypot(closure, slip) / (MAX_STEP * this.joint.length) - 1e-9);
    this.message = "";
    for (let i = 0; i < steps; i++) {
      this.joint.trial([closure / steps, ...this.along.map((e) => (e * slip) / steps)]);
      if (!this.accept("closure", this.level)) return;
      yield;
    }
  }

  /* Repeat the legs of another test */
  *repeat(legs) {
    for (const { hold, level, d, steps } of legs) {
      const [closure, x, y] = d, size = Math.hypot(x, y);
      this.hold = hold;
      if (size) this.turn(degreesOf(x, y));
      const slip = x * this.along[0] + y * this.along[1];
      if (hold === "closure" && closure) yield* this.move(closure, slip);
      else {
        if (hold === "stress" && level !== this.level) yield* this.press(level);
        if (size) yield* this.slide(slip, steps);
      }
      this.level = hold === "stress" ? this.level : this.joint.F[0];
    }
  }
}

/* Tests that can be played, on a loaded joint: each yields after one step */
const PLAYED = {
  *closure(test) {
    const { level } = test;
    yield* test.press(0.001 * level);
    for (const to of [level, 0.001 * level, level]) yield* test.press(to);
  },
  *shear(test) { yield* test.slide(6 * test.joint.length); },
  *cycle(test) {
    for (const way of [3, -6, 6, -6, 6]) yield* test.slide(way * test.joint.length);
  },
  *opening(test) {
    const { level, joint } = test;
    yield* test.slide(2 * joint.length);
    while (!test.isOpen) yield* test.move(-joint.length / 50, 0);
    yield* test.move(-joint.length / 2, 0);
    yield* test.press(level);
  },
};

/* Direction of a slip (x, y) in degrees, from 0 to below 180; the sign of the slip gives its sense */
const degreesOf = (x, y) => (Math.round((1e6 * (Math.atan2(y, x) * 180)) / Math.PI) / 1e6 + 360) % 180;

const finish = (steps) => { for (const step of steps); };

/* --------------------------------------------------- Coulomb and Barton-Bandis for comparison */

/* Shear stress over normal stress in first shear, at slips >= 0 in closures at 10 MPa: Coulomb, a spring
 * and a slider, and Barton-Bandis, the mobilised roughness of 1985 */
const SIMPLER = {
  Coulomb: ([stiffness, friction]) => (x) => Math.min(stiffness * x, friction),
  "Barton-Bandis": ([peak, roughness], mu) => (x) => {
    const at = [0, 0.3, 0.6, 1, 2, 4, 10, 25, 100], rest = Math.atan(mu);
    const share = [-rest / Math.max(roughness, 1e-9), 0, 0.75, 1, 0.85, 0.7, 0.5, 0.4, 0];
    return Math.tan(rest + roughness * interpolated(Math.min(x / peak, 100), at, share));
  },
};

/* Both curves, fitted by least squares to the first shear of this joint over two closures, at this
 * normal stress and direction: [{ name, at (slip -> shear stress) }] */
function simplerLaws(test, mu, level) {
  const { joint } = test, kept = joint.snapshot(), x = [], y = [];
  const first = new Test(joint);
  first.turn(test.degrees);
  finish(first.press(level));
  for (let i = 0; i < 60; i++) {
    finish(first.slide((2 * joint.length) / 60, 1));
    x.push(first.slip / joint.length), y.push(first.rows.at(-1).shear / level);
  }
  joint.restore(kept);
  return Object.entries(SIMPLER).map(([name, law]) => {
    const miss = (q) => { const f = law(q, mu); return x.reduce((sum, s, i) => sum + (f(s) - y[i]) ** 2, 0); };
    const f = law(fitted(miss, name === "Coulomb" ? [1, 0.5] : [2, 0.4]), mu);
    return { name, at: (slip) => Math.sign(slip) * level * f(Math.abs(slip) / joint.length) };
  });
}

/* Two positive numbers that minimise a function: a grid of factors that shrinks around the best one */
function fitted(miss, start) {
  let best = start, least = miss(start);
  for (let width = 2.5; width > 0.01; width *= 0.55) {
    const centre = best;
    for (let i = -4; i <= 4; i++)
      for (let j = -4; j <= 4; j++) {
        const q = [centre[0] * Math.exp((width * i) / 4), centre[1] * Math.exp((width * j) / 4)], now = miss(q);
        if (now < least) [best, least] = [q, now];
      }
  }
  return best;
}

/* ---------------------------------------------------------------------------------- as text */

const short = (x) => String(Number(x.toPrecision(7)));

/* Legs as text, for the address: s (slip at a stress), n (to a normal stress), c (closure prescribed) */
function legsAsText(legs) {
  if (legs.length > MOST_LEGS) return "";
  const words = ({ hold, level, d, steps }) => hold === "closure" ? ["c", ...d, steps]
    : d[1] || d[2] ? ["s", level, d[1], d[2], steps] : ["n", level];
  return legs.map((leg) => words(leg).map((w, i) => (i ? short(w) : w)).join("*")).join("_");
}

function legsOfText(text) {
  return text.split("_").filter(Boolean).map((leg) => {
    const [kind, ...rest] = leg.split("*"), x = rest.map(Number);
    if (!x.every(isFinite) || x.length !== { s: 4, n: 1, c: 4 }[kind]) throw new Error(`unknown: ${leg}`);
    if (kind === "c") return { hold: "closure", level: 0, d: x.slice(0, 3), steps: x[3] };
    return { hold: "stress", level: x[0], d: kind === "s" ? [0, x[1], x[2]] : [0, 0, 0], steps: x[3] || 1 };
  });
}

function csv(test) {
  const head = "closure_m,shear_2_m,shear_3_m,F1_Pa,F2_Pa,F3_Pa";
  return [head, ...test.rows.map(({ at, F }) => [...at, ...F].join(","))].join("\n") + "\n";
}

/* The same law and path in Python */
function python(name, numbers, test) {
  const own = parametersOf(JOINTLAW.rocks[name]), lines = [
    "from dataclasses import replace", "import numpy as np", "import jointlaw as jl", "", `law = jl.presets.load("${name}")`];
  const changed = (key) => numbers[key] !== own[key];
  const turned = ["a", "c"].filter(changed).map((key) => `${key}=${numbers[key]}`);
  const parts = [];
  if (turned.length) parts.push(`orientation=replace(law.orientation, ${turned.join(", ")})`);
  if (changed("mu")) parts.push(`asperity=replace(law.asperity, mu=${numbers.mu})`);
  if (changed("mating")) parts.push(`mating_length=${short(numbers.mating)}`);
  if (parts.length) lines.push(`law = replace(law, ${parts.join(", ")})`);
  lines.push("joint = law.joint()");
  if (test.isShort) lines.push("# the first legs of this long path are not stored");
  for (const { hold, level, d, steps, from } of test.legs) {
    const degrees = degreesOf(d[1], d[2]), angle = (degrees * Math.PI) / 180;
    const slip = d[1] * Math.cos(angle) + d[2] * Math.sin(angle);
    if (hold === "closure") lines.push(`for _ in range(${steps}):`, `    joint.update(np.array([${d.map(short)}]) / ${steps})`);
    else if (!slip) lines.push(`for stress in np.linspace(${short(from)}, ${short(level)}, ${steps} + 1)[1:]:`,
      "    jl.direct_shear(joint, 0.0, normal=stress, steps=1)");
    else lines.push(`record = jl.direct_shear(joint, ${short(slip)}, normal=${short(level)}, azimuth=np.radians(${short(degrees)}), steps=${steps})`);
  }
  return [...lines, 'print(joint.F, "Pa")', ""].join("\n");
}
