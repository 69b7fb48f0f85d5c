/* The story: six steps, each a sentence, one thing to do, and what of the page it is about. before:
 * what was done to the joint when the step begins, as (stress in MPa, slips in closures at 10 MPa
 * along axes 2 and 3). gear: of the hand. done: whether the reader did it; begun: the test when the
 * step began. */

const STORY = [
  {
    name: "Touch",
    tells: "Asperities touch one after the other as the joint closes, and so it becomes stiffer and stiffer.",
    task: "Raise the normal stress to 10 MPa.",
    before: [0.2], meant: ["normal", "level-box"], done: (test) => test.level > 9.5e6,
  },
  {
    name: "Stick",
    tells: "At first nearly all contacts stick (blue): the joint is elastic, and would spring back.",
    task: "Drag the upper block to the right by a finger's breadth. In this step it moves a twentieth as far.",
    before: [10], meant: ["scene"], mark: "stuck", gear: 0.05, done: (test, begun) => test.slip - begun.slip > 0.04 * test.joint.length,
  },
  {
    name: "Slip one by one",
    tells: "Contacts reach friction one after the other (orange). So the curve bends; Coulomb's pale line has a corner.",
    task: "Drag on until all marks are orange.",
    before: [10, [0.05, 0]], meant: ["scene", "stress"], mark: "sliding", done: (test) => test.slip > 1.2 * test.joint.length,
  },
  {
    name: "Dilate",
    tells: "Faces that meet the slip lift the block, the others part (grey). The joint opens, and its strength grows.",
    task: "Drag on to the right, and watch the closure fall.",
    before: [10, [1.2, 0]], meant: ["scene", "closure"], mark: "apart", done: (test) => test.slip > 5 * test.joint.length,
  },
  {
    name: "Turn back",
    tells: "Contacts stick again, then slip the other way one by one. Most of what lies between the two curves is lost to friction.",
    task: "Drag the block back to the left.",
    before: [10, [5, 0]], meant: ["stress"], mark: "sliding", done: (test, begun) => test.slip < begun.slip - 3 * test.joint.length,
  },
  {
    name: "Turn the direction",
    tells: "The joint remembers the first direction. Across it the facets slide another way, and the old shear stress falls.",
    task: "Set the direction to 90°, and drag again.",
    before: [10, [5, 0], [-3, 0]], meant: ["facets", "direction-box"], done: (test, begun) =>
      test.degrees !== begun.degrees && Math.abs(test.slip - begun.across) > 0.8 * test.joint.length,
  },
];

class Story {
  constructor() { this.at = -1; }

  get step() { return STORY[this.at]; }

  /* Go to a step. A joint on which the step before was done stays as it is; else it is made so */
  go(at, again) {
    const goesOn = at === this.at + 1 && this.isDone;
    this.at = Math.max(0, Math.min(STORY.length - 1, at));
    if (!goesOn) again(this.step.before);
    this.isDone = false;
    this.begun = null;
  }

  /* Whether the step is done, told by the test as it is now */
  look(test) {
    if (!this.step) return;
    this.begun = this.begun || { slip: test.slip, degrees: test.degrees, across: test.at[2] };
    this.isDone = this.isDone || this.step.done(test, this.begun);
  }
}
