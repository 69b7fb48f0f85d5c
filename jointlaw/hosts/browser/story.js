/* The tutorial: six steps, each with a question to answer before the experiment, a task, and the
 * explanation, which is shown once the task is done. right: index of the choice that the experiment
 * confirms. before: loading of the joint before the step, as (stress in MPa, slips in closures at
 * 10 MPa along axes 2 and 3). isReady: whether the joint of the previous step can continue in this one;
 * otherwise it is loaded as in `before`. gear: ratio of block to pointer motion, until the next step.
 * isDone(test, seen): whether the experiment has shown what the step is about; seen: see `observe`. */

const STORY = [
  {
    name: "Touch",
    question: "Does the closure double if the normal stress doubles?",
    choices: ["it doubles", "it grows by less", "it grows by more"], right: 1,
    task: "Raise the normal stress from 5 to 10 MPa.",
    explanation: "Asperities come into contact one after the other as the joint closes, so its stiffness increases.",
    before: [5], highlighted: ["normal", "level-box"], gear: 1,
    isReady: () => false,
    isDone: (test) => test.level > 9.5e6,
  },
  {
    name: "Stick",
    question: "Push the block a little, and let it come back. Which way does the shear stress return?",
    choices: ["almost the way it came", "far below it"], right: 0,
    task: "Drag the block slowly to the right until the shear stress is 0.5 MPa, then back until it is zero.",
    explanation: "At first nearly all contacts stick (blue): the joint is elastic, and the stored energy comes back.",
    before: [10], highlighted: ["scene", "stress"], mark: "stuck", gear: 0.005,
    isReady: (test) => Math.abs(test.slip) < 0.02 * test.joint.length,
    isDone: (test, seen) => seen.largest >= 0.05 * test.level && seen.shear <= 0.01 * test.level,
  },
  {
    name: "Slip one by one",
    question: "Drag further. How does the shear stress reach its limit?",
    choices: ["at a corner, as in Coulomb's law", "in a bend"], right: 1,
    task: "Drag to the right until all marks are orange.",
    explanation: "Contacts reach their friction limit one after the other (orange), so the curve bends; Coulomb's pale line has a corner.",
    before: [10, [0.01, 0]], highlighted: ["scene", "stress"], mark: "sliding", gear: 0.04,
    isReady: (test) => Math.abs(test.slip) < 0.2 * test.joint.length,
    isDone: (test, seen) => seen.shear > 0 && seen.sliding > 0.95,
  },
  {
    name: "Dilate",
    question: "The asperities are ramps. What does the joint do while it slides on?",
    choices: ["it closes", "it opens", "neither"], right: 1,
    task: "Drag on to the right until the closure has fallen visibly.",
    explanation: "Facets that face the slip lift the block (dilation), the others separate (grey). The joint opens, and its strength increases.",
    before: [10, [1, 0]], highlighted: ["scene", "closure"], mark: "separated", gear: 0.25,
    isReady: (test) => test.slip > 0 && test.slip < 3 * test.joint.length,
    isDone: (test, seen) => seen.first.closure - test.closure > 0.1 * test.joint.length,
  },
  {
    name: "Turn back",
    question: "Drag the block back. Does the shear stress return the way it came?",
    choices: ["yes", "no, it falls steeply and changes its sign"], right: 1,
    task: "Drag to the left until the shear stress is negative and all marks are orange or grey.",
    explanation: "Contacts stick again, then slip in the opposite direction one by one. Most of the work between the two curves is dissipated by friction.",
    before: [10, [5, 0]], highlighted: ["stress"], mark: "sliding", gear: 0.1,
    isReady: (test) => test.slip > 2 * test.joint.length && test.rows.at(-1).shear > 0,
    isDone: (test, seen) => seen.shear < 0 && seen.sliding > 0.95,
  },
  {
    name: "Turn the direction",
    question: "The block has slid along 0°. What happens to that shear stress if it slides along 90°?",
    choices: ["it stays", "it decreases"], right: 1,
    task: "Set the direction to 90°, and drag.",
    explanation: "The joint depends on its path. With slip at a right angle the facets slide in another direction, and the old shear stress decreases.",
    before: [10, [2, 0]], highlighted: ["facets", "direction-box"], gear: 0.1,
    isReady: () => false, // friction of the slip back would be small already
    isDone: (test, seen) => test.degrees === 90 && Math.abs(test.at[2] - seen.first.at[2]) > 0.8 * test.joint.length,
  },
];

/* Share of the load that sliding facets bear */
function slidingShare(facets) {
  const sum = (some) => some.reduce((total, facet) => total + facet.load, 0);
  return sum(facets.filter((facet) => facet.slides > 0.5)) / Math.max(sum(facets), 1e-300);
}

class Story {
  constructor() { this.at = -1; }

  get step() { return STORY[this.at]; }

  /* Go to a step. After a completed step the same joint continues if it is ready for the next one;
   * otherwise `load` makes a new joint, loaded as the step needs it */
  go(at, test, load) {
    const continues = at === this.at + 1 && this.isDone && at < STORY.length;
    this.at = Math.max(0, Math.min(STORY.length - 1, at));
    this.prediction = null;
    const isPrescribed = test && test.hold === "stress" && Math.abs(test.joint.F[0] - 1e6 * this.step.before[0]) < 5e5;
    this.begin();
    if (!(continues && isPrescribed && this.step.isReady(test))) load(this.step.before);
  }

  /* Observe this step from now on */
  begin() {
    this.isDone = false;
    this.seen = null;
  }

  predict(choice) { this.prediction = choice; }

  /* Update what the experiment has shown since the step began: first (closure, at), shear (the present
   * shear stress), largest (shear stress), sliding (share of the load on sliding facets) */
  observe(test, facets) {
    const last = test.rows.at(-1);
    if (!this.step || !last) return;
    const shear = last.turn === test.turns ? last.shear : 0;
    const { first, largest } = this.seen || { first: { closure: test.closure, at: test.at }, largest: shear };
    this.seen = { first, shear, largest: Math.max(largest, shear), sliding: slidingShare(facets) };
    this.isDone = this.isDone || this.step.isDone(test, this.seen);
  }

  /* The outcome of the prediction, after the step is done */
  get verdict() {
    const { choices, right } = this.step;
    if (this.prediction === null) return "";
    return this.prediction === right ? "As you predicted." : `You predicted "${choices[this.prediction]}"; the answer is "${choices[right]}".`;
  }
}
