/* The page "Match shear tests by hand": direct shear at constant normal stress by the compiled law, and a
 * fit. Needs law.js and the constants JOINTLAW and MATCH. Units: m, Pa; in MATCH mm and MPa. */

const STEPS = 60; // of shear
const PRESS_STEPS = 20;
const PARAMETERS = ["mu", "steep", "mating"];

const byId = (name) => document.getElementById(`match-${name}`);
let joint, showsUnseen = false;

/* ---------------------------------------------------------------------------------- the law */

/* Parameters of the law; steep: inclination of the steepest faces in degrees, mating: m */
const lawTables = ({ mu, steep, mating }) => tablesOf(MATCH.rock, { a: 90 / steep, c: MATCH.rock.c, mu, mating });

/* Shear stress (Pa) at STEPS + 1 even displacements up to MATCH.end, under a normal stress (Pa) */
function shearCurve(stress) {
  joint.reset();
  for (let i = 1; i <= PRESS_STEPS; i++) {
    joint.closing([0, 0], stress * (i / PRESS_STEPS) ** 2);
    joint.commit();
  }
  const curve = [joint.F[1]];
  for (let i = 0; i < STEPS; i++) {
    joint.closing([(1e-3 * MATCH.end) / STEPS, 0], stress);
    joint.commit();
    curve.push(joint.F[1]);
  }
  return curve;
}

/* Curves of the tests with these parameters; all tests, or only the fitted ones */
function curves(parameters, all) {
  joint = new Joint(joint.wasm, lawTables(parameters));
  return MATCH.tests.map((test) => (all || test.fitted ? shearCurve(1e6 * test.stress) : null));
}

/* Displacement (mm) of the peak of a curve: of the parabola through the largest stress and its neighbours */
function peakDisplacement(curve) {
  const k = Math.min(Math.max(curve.indexOf(Math.max(...curve)), 1), STEPS - 1);
  const [before, top, after] = curve.slice(k - 1, k + 2);
  const bend = before - 2 * top + after;
  return ((k + (bend < 0 ? (0.5 * (before - after)) / bend : 0)) * MATCH.end) / STEPS;
}

const rms = (errors) => Math.sqrt(errors.reduce((sum, e) => sum + e * e, 0) / errors.length);

/* Root mean square of the relative errors of peak and last stress, and of the peak's displacement, in the
 * tests that are fitted, or in the others */
function misfits(parameters, fitted = true) {
  const all = curves(parameters, !fitted), stresses = [], displacements = [];
  MATCH.tests.forEach((test, i) => {
    if (test.fitted !== fitted) return;
    stresses.push(Math.max(...all[i]) / (1e6 * test.peak) - 1, all[i][STEPS] / (1e6 * test.last) - 1);
    displacements.push(peakDisplacement(all[i]) / test.at - 1);
  });
  return [rms(stresses), rms(displacements)];
}

/* What the fit minimises: specimens differ more in the displacement of the peak than in stresses */
const DISPLACEMENT_WEIGHT = 0.1;
const objective = (parameters) => Math.hypot(...misfits(parameters).map((e, k) => (k ? DISPLACEMENT_WEIGHT * e : e)));

/* ---------------------------------------------------------------------------------- the fit */

/* Minimise a function of positive numbers from a start by the simplex of Nelder and Mead, in logarithms */
function minimise(f, start, iterations = 90) {
  const value = (x) => ({ x, y: f(x.map(Math.exp)) });
  const first = start.map(Math.log);
  let simplex = [value(first), ...first.map((_, k) => value(first.map((x, i) => x + (i === k ? 0.25 : 0))))];
  for (let n = 0; n < iterations; n++) {
    simplex.sort((p, q) => p.y - q.y);
    const worst = simplex.at(-1), others = simplex.slice(0, -1);
    const centre = first.map((_, i) => others.reduce((sum, p) => sum + p.x[i], 0) / others.length);
    const along = (t) => value(centre.map((x, i) => x + t * (worst.x[i] - x)));
    let next = along(-1);
    if (next.y < simplex[0].y) {
      const far = along(-2);
      if (far.y < next.y) next = far;
    } else if (next.y >= others.at(-1).y) next = along(next.y < worst.y ? -0.5 : 0.5);
    if (next.y < worst.y) simplex = [...others, next];
    else simplex = simplex.map((p, k) => (k ? value(p.x.map((x, i) => 0.5 * (x + simplex[0].x[i]))) : p));
  }
  return simplex.sort((p, q) => p.y - q.y)[0].x.map(Math.exp);
}

/* --------------------------------------------------------------------------------- the page */

const read = () => ({ mu: +byId("mu").value, steep: +byId("steep").value, mating: 1e-3 * 10 ** +byId("mating").value });

function draw() {
  const parameters = read();
  byId("mu-value").textContent = parameters.mu.toFixed(3);
  byId("steep-value").textContent = `${parameters.steep.toFixed(1)}°`;
  byId("mating-value").textContent = `${(1e3 * parameters.mating).toFixed(1)} mm`;
  const percent = (fitted) => {
    const [stresses, displacements] = misfits(parameters, fitted);
    return `${(100 * stresses).toFixed(1)} % of peak and last stresses, ${(100 * displacements).toFixed(0)} % of the peaks' displacements`;
  };
  const unseen = showsUnseen ? `. Unseen, at 2 and 4 MPa: ${percent(false)}` : "";
  byId("result").textContent = `Error at 1, 3 and 5 MPa: ${percent(true)}${unseen}.`;
  plotCurves(curves(parameters, showsUnseen));
}

/* Colour of the theme, which can change while the page is open */
function colour(name) {
  byId("result").style.outlineColor = `var(--${name})`;
  return getComputedStyle(byId("result")).outlineColor;
}

function plotCurves(all) {
  const place = byId("plot"), ratio = window.devicePixelRatio || 1, wide = place.clientWidth, high = place.clientHeight;
  [place.width, place.height] = [wide * ratio, high * ratio];
  const c = place.getContext("2d"), ink = colour("ink");
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  c.font = "12px system-ui, sans-serif";
  const left = 44, right = wide - 48, top = 12, bottom = high - 38, largest = 7; // MPa
  const X = (mm) => left + ((right - left) * mm) / MATCH.end, Y = (mpa) => bottom - ((bottom - top) * mpa) / largest;
  c.fillStyle = ink;
  c.strokeStyle = colour("line");
  c.lineWidth = 0.5;
  c.textAlign = "center";
  for (let mm = 0; mm <= MATCH.end; mm += 2) c.fillText(mm, X(mm), bottom + 16), line([[mm, 0], [mm, largest]]);
  c.fillText("shear displacement (mm)", (left + right) / 2, bottom + 33);
  c.textAlign = "right";
  for (let mpa = 0; mpa <= largest; mpa++) c.fillText(mpa, left - 6, Y(mpa) + 4), line([[0, mpa], [MATCH.end, mpa]]);
  c.save();
  c.translate(13, (top + bottom) / 2);
  c.rotate(-Math.PI / 2);
  c.textAlign = "center";
  c.fillText("shear stress (MPa)", 0, 0);
  c.restore();
  c.textAlign = "left";
  c.lineWidth = 2;
  MATCH.tests.forEach((test, i) => {
    if (!all[i]) return;
    c.strokeStyle = c.fillStyle = colour(test.fitted ? "curve" : "unseen");
    line(all[i].map((stress, k) => [(MATCH.end * k) / STEPS, 1e-6 * stress]));
    c.fillText(`${test.stress} MPa`, X(MATCH.end) + 7, Y(test.last) + 4);
    for (const [mm, mpa] of [[test.at, test.peak], [test.end, test.last]]) {
      c.beginPath();
      c.arc(X(mm), Y(mpa), 4, 0, 2 * Math.PI);
      c.fill();
    }
  });

  function line(points) {
    c.beginPath();
    points.forEach(([mm, mpa], k) => (k ? c.lineTo(X(mm), Y(mpa)) : c.moveTo(X(mm), Y(mpa))));
    c.stroke();
  }
}

function fit() {
  const from = read();
  const named = (x) => Object.fromEntries(PARAMETERS.map((name, i) => [name, x[i]]));
  const bounds = { mu: [0.2, 0.9], steep: [8, 45], mating: [1e-3, 0.1] };
  const outside = (p) => PARAMETERS.some((name) => p[name] < bounds[name][0] || p[name] > bounds[name][1]);
  const best = named(minimise((x) => (outside(named(x)) ? 10 : objective(named(x))), PARAMETERS.map((name) => from[name])));
  byId("mu").value = best.mu;
  byId("steep").value = best.steep;
  byId("mating").value = Math.log10(1e3 * best.mating);
  draw();
}

async function openMatch() {
  const { exports } = (await WebAssembly.instantiate(decoded(JOINTLAW.wasm), {})).instance;
  MATCH.rock = JOINTLAW.rocks.sandstone;
  MATCH.rock.bytes = decoded(MATCH.rock.tables);
  joint = new Joint(exports, MATCH.rock.bytes);
  for (const name of PARAMETERS) byId(name).oninput = draw;
  byId("fit").onclick = fit;
  byId("unseen").onclick = () => { showsUnseen = true; draw(); };
  new ResizeObserver(draw).observe(byId("plot"));
  draw();
}

openMatch();
