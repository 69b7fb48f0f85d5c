/* The page: controls, pointer, address. */

const TOUCH_GEAR = 0.4; // block over finger, relative to block over mouse
let pointer = "mouse"; // the kind that was used last
let exports, test, numbers, simpler = [], playing = null, drawn = false, spin = -0.6, resting = 0;
const story = new Story();
const MATINGS = [0.5, 1, 2, 3, 5, 8, 12, 20, 40, Infinity]; // mating length in closures at 10 MPa

const rockName = () => part("preset").value;
const rock = () => JOINTLAW.rocks[rockName()];

// --------------------------------------------------------------------------------------- drawing

function redraw() {
  if (drawn || !test) return;
  drawn = true;
  requestAnimationFrame(draw);
}

function draw() {
  drawn = false;
  readColours();
  const facets = test.joint.facetStates();
  story.observe(test, facets);
  const mark = story.step && !story.isDone ? story.step.mark : "";
  drawScene(test, facets, numbers.mating, mark, gear());
  drawCurves(test, simpler);
  drawHemisphere(test, facets, numbers.a, spin);
  showNumbers();
  showStory();
  clearTimeout(resting);
  resting = setTimeout(rest, 400);
}

/* After a pause: text for screen readers, and the address */
function rest() {
  const last = test.rows.at(-1);
  if (!last || playing) return;
  part("status").textContent = `${test.message} ${part("values").textContent}`;
  part("scene").setAttribute("aria-valuenow", three(test.slip / test.joint.length));
  part("scene").setAttribute("aria-valuetext", part("values").textContent);
  const { a, c, mu, mating } = numbers, legs = legsAsText(test.legs);
  const state = { rock: rockName(), a, c, mu, mating, hold: test.hold, turn: test.degrees, path: legs };
  history.replaceState(null, "", `#${new URLSearchParams(state)}`);
}

function showNumbers() {
  const { joint } = test, [per, unit] = scale(joint.length), size = joint.length * per;
  const last = test.rows.at(-1) || { normal: 0, shear: 0 };
  part("values").textContent = `normal stress ${three(last.normal / 1e6)} MPa, shear stress ${three(last.shear / 1e6)} MPa, `
    + `closure ${three(test.closure * per, size)} ${unit}, slip ${three(test.slip * per, size)} ${unit}`;
  part("message").textContent = test.message;
  const stored = joint.stored, lost = joint.dissipated, most = Math.max(stored + lost, 1e-300);
  const joules = (x) => `${three(x, most)} J/m²`;
  part("stored").textContent = joules(stored);
  part("lost").textContent = joules(lost);
  part("stored-bar").style.width = `${(100 * stored) / most}%`;
  part("lost-bar").style.width = `${(100 * lost) / most}%`;
  const held = test.hold === "stress";
  part("level-name").textContent = held ? "Normal stress" : "Closure";
  part("level").value = held ? (400 * test.level) / FULL_STRESS : 200 * (test.closure / joint.length);
  part("level-value").textContent = held ? `${three(test.level / 1e6)} MPa` : `${three(test.closure * per, size)} ${unit}`;
  part("direction").value = test.degrees;
  part("direction-value").textContent = `${test.degrees}°`;
  part("hold").value = test.hold;
  for (const name of ["a", "c", "mu"]) (part(name).value = numbers[name]), (part(`${name}-value`).textContent = three(numbers[name]));
  const { mating } = numbers;
  part("mating-value").textContent = mating < Infinity ? `${three(mating * per)} ${unit}` : "infinite";
  part("scene").style.touchAction = held ? "pan-y" : "none";
}

function showStory() {
  const { step, at, isDone } = story;
  if (!step) return;
  part("step").textContent = `${at + 1} of ${STORY.length}: ${step.name}. `;
  part("explanation").textContent = isDone ? `${story.verdict} ${step.explanation}`.trim() : step.question;
  part("choices").hidden = isDone;
  showChoices(step);
  const isLast = at + 1 === STORY.length;
  part("task").textContent = isDone ? (isLast ? "Done. The tutorial is complete: now try the parameters of the joint." : "Done. Continue with Next.") : step.task;
  part("next").disabled = isLast;
  part("back").disabled = at === 0;
  for (const place of document.querySelectorAll("#joint .highlighted")) place.classList.remove("highlighted");
  for (const name of isDone ? ["next"] : step.highlighted) part(name).classList.add("highlighted");
}

/* Buttons with the possible answers to the question of a step */
function showChoices(step) {
  const place = part("choices");
  if (place.dataset.step !== step.name) {
    place.dataset.step = step.name;
    place.replaceChildren(...step.choices.map((choice, i) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = choice;
      button.onclick = () => (story.predict(i), redraw());
      return button;
    }));
  }
  [...place.children].forEach((button, i) => button.setAttribute("aria-pressed", String(story.prediction === i)));
}

// ------------------------------------------------------------------------------------- actions

/* Run an action and redraw; an invalid step shows its message and changes no state */
function guarded(what) {
  try {
    what();
  } catch (error) {
    playing = null;
    test.message = error.message;
  }
  redraw();
}

/* A new joint of this rock with these parameters, loaded by these legs */
function rebuild(legs) {
  playing = null;
  if (!story.isDone) story.begin(); // what it has seen was of another joint
  const { degrees, hold } = test || { degrees: 0, hold: "stress" };
  guarded(() => {
    const created = new Test(new Joint(exports, tablesOf(rock(), numbers)));
    created.turn(degrees);
    test = created;
    finish(test.repeat(legs));
    test.requested = { legs, rows: test.rows.length }; // complete: with other parameters it may go further
    if (hold === "stress") test.turn(degrees), (test.hold = hold);
    compare();
  });
}

/* The path of this joint, or the requested path if nothing happened since */
const path = () => (test.requested && test.requested.rows === test.rows.length ? test.requested.legs : test.legs);

/* The leg that loads a joint to this normal stress */
const loadTo = (level) => ({ hold: "stress", level, d: [0, 0, 0], steps: 1 });

/* Legs of the loading before a step of the tutorial */
function legsFor([stress, ...slips]) {
  const { length } = test.joint, legs = [loadTo(stress * 1e6)];
  for (const [x, y] of slips)
    legs.push({ ...legs[0], d: [0, x * length, y * length], steps: Math.ceil(100 * Math.hypot(x, y)) });
  return legs;
}

/* A new joint, loaded for a step of the tutorial along direction 0 */
function loadFor(before) {
  if (test) (test.degrees = 0), (test.hold = "stress");
  rebuild(legsFor(before));
}

/* Go to a step of the tutorial */
function goTo(at) {
  playing = null;
  story.go(at, test, loadFor);
  redraw();
}

/* Update the curves of Coulomb and Barton-Bandis for this stress and direction */
function compare() {
  simpler = test.hold === "stress" && test.level > 0 ? simplerLaws(test, numbers.mu, test.level) : [];
}

/* Move the upper block */
function drag(slip, closure) {
  playing = null;
  guarded(() => finish(test.hold === "stress" ? test.slide(slip) : test.move(closure, slip)));
}

/* Set the normal stress or closure, from 0 to 1, at this slip */
function setLevel(share) {
  playing = null;
  guarded(() => {
    if (test.hold === "closure") return finish(test.move(2 * share * test.joint.length - test.closure, 0));
    finish(test.press(Math.max(share, 0.005) * FULL_STRESS));
    compare();
  });
}

/* Start a new joint at this normal stress; play a test if one is named */
function play(name) {
  const { level, hold } = test;
  const start = level > 0 ? level : Math.max(test.joint.F[0], INITIAL_STRESS / 10);
  rebuild([loadTo(start)]);
  test.hold = hold;
  playing = name ? PLAYED[name](test) : null;
  const mine = playing, advance = () => {
    if (playing !== mine || !mine) return;
    guarded(() => {
      for (let i = 0; i < 8 && playing; i++) if (mine.next().done) playing = null;
    });
    if (playing) requestAnimationFrame(advance);
  };
  advance();
}

/* Select another rock with its parameters, loaded to 10 MPa */
function begin() {
  numbers = parametersOf(rock());
  const bound = 1 / 3 - rock().b / 6;
  [part("c").min, part("c").max] = [-bound, bound];
  part("mating").value = MATINGS.length - 1;
  rebuild([loadTo(INITIAL_STRESS)]);
}

// ---------------------------------------------------------------------------------------- the page

function listen() {
  for (const name of Object.keys(JOINTLAW.rocks)) part("preset").add(new Option(name));
  part("preset").value = "westerly-smooth";
  part("preset").onchange = begin;
  for (const name of ["a", "c", "mu"])
    part(name).oninput = () => ((numbers[name] = Number(part(name).value)), rebuild(path()));
  part("mating").max = MATINGS.length - 1;
  part("mating").oninput = () => ((numbers.mating = MATINGS[part("mating").value] * test.joint.length), rebuild(path()));
  part("direction").oninput = () => guarded(() => (test.turn(Number(part("direction").value)), compare()));
  part("hold").onchange = () => guarded(() => {
    test.hold = part("hold").value;
    test.level = Math.max(0, test.joint.F[0]);
    compare();
  });
  part("level").oninput = () => setLevel(part("level").value / 400);
  for (const button of document.querySelectorAll("#joint [data-test]")) button.onclick = () => play(button.dataset.test);
  part("next").onclick = () => goTo(story.at + 1);
  part("back").onclick = () => goTo(story.at - 1);
  part("again").onclick = () => (story.begin(), loadFor(story.step ? story.step.before : [10]));
  part("python").onclick = () => give(python(rockName(), numbers, test), "jointlaw.py", "This law and path in Python");
  part("csv").onclick = () => give(csv(test), "joint.csv", "All steps");
  part("link").onclick = () => (rest(), give(location.href, "", "The address of this joint"));
  for (const [name, act] of [["scene", hand], ["facets", turnHemisphere]]) follow(part(name), act);
  part("scene").onkeydown = key;
  window.addEventListener("resize", redraw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  new MutationObserver(redraw).observe(document.body, { attributeFilter: ["data-theme"] });
}

/* Call act(x, y) with the motion of one finger, or of the mouse with its first button pressed */
function follow(place, act) {
  let from = null;
  place.onpointerdown = (event) => {
    pointer = event.pointerType;
    from = null; // a second finger ends the drag
    if (!event.isPrimary || event.button !== 0) return;
    from = event;
    place.setPointerCapture(event.pointerId);
  };
  place.onpointermove = (event) => {
    if (!from || event.pointerId !== from.pointerId) return;
    act(event.clientX - from.clientX, event.clientY - from.clientY);
    from = event;
  };
  place.onpointerup = place.onpointercancel = () => (from = null);
}

/* Motion of the block over motion of the pointer: of the step, until the next one. A finger is as wide
 * as the picture's range of slips, so without a step it moves the block less than a mouse does */
const gear = () => (story.step ? story.step.gear : 1) * (pointer === "touch" ? TOUCH_GEAR : 1);
const hand = (x, y) => drag((gear() * x) / zoomOf(test), (gear() * y) / zoomOf(test));
const turnHemisphere = (x) => ((spin += x / 80), redraw());

function key(event) {
  const ways = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }, way = ways[event.key];
  if (!way || (test.hold === "stress" && way[1])) return; // the page scrolls
  event.preventDefault();
  const size = test.joint.length * Math.min(1 / 20, story.step ? story.step.gear : 1);
  drag(way[0] * size, way[1] * size);
}

/* Copy a text, or show it if the browser does not allow copying; offer it as a file */
async function give(text, file, name) {
  part("text").value = text;
  part("copied").open = true;
  const link = part("file");
  link.hidden = !file;
  link.download = file;
  link.href = URL.createObjectURL(new Blob([text], { type: "text/plain" }));
  const copied = await navigator.clipboard?.writeText(text).then(() => true, () => false);
  part("copied-name").textContent = copied ? `${name}: copied` : name;
}

/* Restore the joint from the address, play the test or start the step of the tutorial that it names, or
 * start the tutorial */
function restoreFromAddress() {
  const address = new URLSearchParams(location.hash.slice(1));
  if (address.get("rock") in JOINTLAW.rocks) part("preset").value = address.get("rock");
  begin();
  try {
    for (const name of ["a", "c", "mu", "mating"]) {
      const value = Number(address.get(name) || "nothing");
      if (value >= { a: 1, c: -1, mu: 0, mating: 0 }[name]) numbers[name] = value;
    }
    if (address.has("path")) {
      const legs = legsOfText(address.get("path"));
      rebuild(legs.length ? legs : legsFor([10]));
      test.turn(Number(address.get("turn")) || 0);
      if (address.get("hold") === "closure") test.hold = "closure";
    } else if (address.get("play") in PLAYED) play(address.get("play"));
    else goTo((Number(address.get("step")) || 1) - 1);
  } catch (error) {
    begin();
    test.message = `The address is not valid (${error.message}); this is a new joint.`;
  }
}

async function open() {
  try {
    if (typeof JOINTLAW === "undefined") throw new Error("its script law.js is missing");
    exports = (await WebAssembly.instantiate(decoded(JOINTLAW.wasm), {})).instance.exports;
    for (const one of Object.values(JOINTLAW.rocks)) one.bytes = decoded(one.tables);
    listen();
    restoreFromAddress();
    redraw();
  } catch (error) {
    part("message").textContent = `The joint cannot be shown: ${error.message}.`;
    throw error;
  }
}

open();
