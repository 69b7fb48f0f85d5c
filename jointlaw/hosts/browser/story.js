/* The tutorial: six steps, each with an explanation, a task and highlighted parts of the page. before:
 * loading of the joint before the step, as (stress in MPa, slips in closures at 10 MPa along axes 2 and
 * 3). gear: ratio of block to pointer motion. done: whether the task is complete; begun: the test at
 * the start of the step. */

const STORY = [
  {
    name: "Touch",
    explanation: "Asperities come into contact one after the other as the joint closes, so its stiffness increases.",
    task: "Raise the normal stress to 10 MPa.",
    before: [0.2], highlighted: ["normal", "level-box"], done: (test) => test.level > 9.5e6,
  },
  {
    name: "Stick",
    explanation: "At first nearly all contacts stick (blue): the joint is elastic.",
    task: "Drag the upper block slightly to the right. In this step it moves a twentieth of the pointer's motion.",
    before: [10], highlighted: ["scene"], mark: "stuck", gear: 0.05, done: (test, begun) => test.slip - begun.slip > 0.04 * test.joint.length,
  },
  {
    name: "Slip one by one",
    explanation: "Contacts reach their friction limit one after the other (orange), so the curve bends; Coulomb's pale line has a corner.",
    task: "Drag on until all marks are orange.",
    before: [10, [0.05, 0]], highlighted: ["scene", "stress"], mark: "sliding", done: (test) => test.slip > 1.2 * test.joint.length,
  },
  {
    name: "Dilate",
    explanation: "Facets that face the slip lift the block (dilation), the others separate (grey). The joint opens, and its strength increases.",
    task: "Drag on to the right, and watch the closure fall.",
    before: [10, [1.2, 0]], highlighted: ["scene", "closure"], mark: "separated", done: (test) => test.slip > 5 * test.joint.length,
  },
  {
    name: "Turn back",
    explanation: "Contacts stick again, then slip in the opposite direction one by one. Most of the work between the two curves is dissipated by friction.",
    task: "Drag the block back to the left.",
    before: [10, [5, 0]], highlighted: ["stress"], mark: "sliding", done: (test, begun) => test.slip < begun.slip - 3 * test.joint.length,
  },
  {
    name: "Turn the direction",
    explanation: "The joint depends on its path. With slip at a right angle the facets slide in another direction, and the old shear stress decreases.",
    task: "Set the direction to 90°, and drag again.",
    before: [10, [5, 0], [-3, 0]], highlighted: ["facets", "direction-box"], done: (test, begun) =>
      test.degrees !== begun.degrees && Math.abs(test.slip - begun.across) > 0.8 * test.joint.length,
  },
];

class Story {
  constructor() { this.at = -1; }

  get step() { return STORY[this.at]; }

  /* Go to a step. After a completed step the joint continues; otherwise it is loaded to the start */
  go(at, again) {
    const goesOn = at === this.at + 1 && this.isDone;
    this.at = Math.max(0, Math.min(STORY.length - 1, at));
    if (!goesOn) again(this.step.before);
    this.isDone = false;
    this.begun = null;
  }

  /* Update whether the task is complete */
  look(test) {
    if (!this.step) return;
    this.begun = this.begun || { slip: test.slip, degrees: test.degrees, across: test.at[2] };
    this.isDone = this.isDone || this.step.done(test, this.begun);
  }
}
