/* Pictures of a test: the two faces, curves, and the facets on a hemisphere. */

const part = (name) => document.getElementById(`joint-${name}`);
const COLOURS = ["ink", "faint", "line", "rock", "over", "stuck", "sliding", "separated", "coulomb", "barton"];
let colours = {};

/* Prepare a canvas for one picture, in CSS pixels */
function canvas(name) {
  const place = part(name), ratio = window.devicePixelRatio || 1;
  const wide = place.clientWidth, high = place.clientHeight;
  const c = place.getContext("2d"), pixels = [wide, high].map((size) => Math.round(size * ratio));
  if (place.width !== pixels[0] || place.height !== pixels[1]) [place.width, place.height] = pixels;
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  c.clearRect(0, 0, wide, high);
  c.font = `${wide < 220 ? 11 : 12}px system-ui, sans-serif`;
  c.lineJoin = c.lineCap = "round";
  return { c, wide, high };
}

/* Colours of the theme, which can change while the page is open */
function readColours() {
  for (const name of COLOURS) {
    part("probe").style.color = `var(--${name})`;
    colours[name] = getComputedStyle(part("probe")).color;
  }
}

const scale = (length) => length >= 1e-4 ? [1e3, "mm"] : length >= 5e-8 ? [1e6, "µm"] : [1e9, "nm"];

/* Three digits; 0 for rounding errors of numbers of this size */
const three = (x, size = 1) => (Math.abs(x) < 1e-6 * size ? "0" : String(Number(x.toPrecision(3))));

function niceStep(range, most) {
  const rough = range / most, power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((s) => s * power >= rough);
}

const tidy = (x, step) => (Math.abs(x) < step / 2 ? 0 : x).toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));

/* Draw lines in axes. lines: { x, y, colour, name, wide, pale } in the units of the labels;
 * smallest: range of each axis. A line that is pale has no mark at its end, and only a line that is
 * not pale makes the axes longer */
function plot(name, xLabel, yLabel, lines, smallest) {
  const { c, wide, high } = canvas(name);
  const bounds = (key, least) => {
    let [low, high] = [Infinity, -Infinity];
    for (const line of lines)
      if (!line.pale) for (const v of line[key]) (low = Math.min(low, v)), (high = Math.max(high, v));
    const more = Math.max(0.04 * (high - low), (least - (high - low)) / 2);
    return [low - more, high + more];
  };
  const [x0, x1] = bounds("x", smallest[0]), [y0, y1] = bounds("y", smallest[1]);
  const xStep = niceStep(x1 - x0, wide / 60), yStep = niceStep(y1 - y0, high / 40);
  const left = 40, right = wide - 8, top = 22, bottom = high - 34;
  const X = (x) => left + ((right - left) * (x - x0)) / (x1 - x0);
  const Y = (y) => bottom - ((bottom - top) * (y - y0)) / (y1 - y0);
  c.fillStyle = colours.faint;
  c.strokeStyle = colours.line;
  c.lineWidth = 0.5;
  c.textBaseline = "top";
  c.textAlign = "center";
  for (let x = Math.ceil(x0 / xStep) * xStep; x <= x1 + 1e-9 * xStep; x += xStep) {
    c.strokeRect(X(x), top, 0, bottom - top);
    c.fillText(tidy(x, xStep), X(x), bottom + 4);
  }
  c.fillText(xLabel, (left + right) / 2, bottom + 19);
  c.textBaseline = "middle";
  c.textAlign = "right";
  for (let y = Math.ceil(y0 / yStep) * yStep; y <= y1 + 1e-9 * yStep; y += yStep) {
    c.strokeRect(left, Y(y), right - left, 0);
    c.fillText(tidy(y, yStep), left - 5, Y(y));
  }
  c.textAlign = "left";
  let at = 4;
  const titles = lines.filter((line) => line.name);
  for (const title of [...titles, { name: yLabel, colour: colours.faint }]) {
    c.fillStyle = title.colour; // the label of the vertical axis, in the colours of its lines
    c.fillText(title.name, at, 10);
    at += c.measureText(title.name).width + 6;
  }
  c.save();
  c.beginPath();
  c.rect(left, top - 6, wide - left, bottom - top + 12);
  c.clip();
  for (const line of lines) {
    c.strokeStyle = c.fillStyle = line.colour;
    c.lineWidth = line.wide || 2;
    c.globalAlpha = line.pale ? 0.55 : 1;
    c.beginPath();
    line.x.forEach((x, i) => c.lineTo(X(x), Y(line.y[i])));
    c.stroke();
    if (line.pale || !line.x.length) continue;
    c.beginPath();
    c.arc(X(line.x.at(-1)), Y(line.y.at(-1)), 4.5, 0, 7);
    c.fill();
  }
  c.restore();
}

/* Thin the rows to as many as a screen can show */
const thinned = (rows, most = 1500) => {
  const every = Math.ceil(rows.length / most);
  return every < 2 ? rows : rows.filter((_, i) => i % every === 0 || i === rows.length - 1);
};

/* Draw the curves of a test; simpler: curves of other laws */
function drawCurves(test, simpler) {
  const [per, unit] = scale(test.joint.length), few = test.joint.length * per, rows = thinned(test.rows);
  const column = (some, key, factor) => some.map((row) => row[key] * factor);
  const slipLabel = `slip (${unit})`, closureLabel = `closure (${unit})`;
  const line = (some, key, factor, more) => ({ x: column(some, "slip", per), y: column(some, key, factor), ...more });
  const byTurn = (some) => [true, false].map((last) => some.filter((row) => (row.turn === test.turns) === last));
  const [now, before] = byTurn(rows);
  const here = now.length ? now : [{ ...test.rows.at(-1), slip: test.slip, shear: 0 }];
  const most = Math.max(few, ...here.map((row) => Math.abs(row.slip * per)));
  const across = Array.from({ length: 121 }, (_, i) => (most * (i - 60)) / 60 + 1e-9 * few);
  const others = simpler.map(({ name, at }) => ({
    x: across, y: across.map((x) => at(x / per) / 1e6), colour: colours[name === "Coulomb" ? "coulomb" : "barton"], pale: true }));
  plot("stress", slipLabel, "stress (MPa)", [
    ...others,
    line(before, "shear", 1e-6, { colour: colours.sliding, pale: true, wide: 1 }),
    line(here, "normal", 1e-6, { colour: colours.faint, name: "normal" }),
    line(here, "shear", 1e-6, { colour: colours.sliding, name: "shear" }),
  ], [few, 0.1]);
  const slid = rows.findIndex((row) => row.d[1] || row.d[2]), [last, earlier] = byTurn([...rows.slice(Math.max(0, slid)), ...rows.slice(-1)]);
  plot("closure", slipLabel, "", [
    line(earlier, "closure", per, { colour: colours.stuck, pale: true, wide: 1 }),
    line(slid < 0 ? here.slice(-1) : last, "closure", per, { colour: colours.stuck, name: closureLabel }),
  ].filter((one) => one.x.length), [few, 0.1 * few]);
  plot("normal", closureLabel, "", [
    { x: column(rows, "closure", per), y: column(rows, "normal", 1e-6), colour: colours.ink, name: "normal stress (MPa)" },
  ], [0.1 * few, 0.1]);
}

/* Facets as dots on the hemisphere that holds them all: its top is flat, its rim the steepest
 * inclination. Size: load; colour: state. spin: rotation of the view, rad */
function drawHemisphere(test, facets, a, spin) {
  const { c, wide, high } = canvas("facets"), R = Math.min(wide / 2 - 12, (high - 40) / 1.45);
  const x0 = wide / 2, y0 = high - 14 - R * 0.5, lift = Math.sqrt(0.75);
  const seen = (u, azimuth) => { // u: height on the sphere
    const flat = Math.sqrt(Math.max(0, 1 - u * u)), [x, y] = [flat * Math.cos(azimuth + spin), flat * Math.sin(azimuth + spin)];
    return { x: x0 + R * x, y: y0 - R * (0.5 * y + lift * u), back: y };
  };
  c.strokeStyle = colours.line;
  c.lineWidth = 1;
  for (const u of [0, 0.5, Math.sqrt(0.75)]) {
    c.beginPath();
    for (let i = 0; i <= 72; i++) { const p = seen(u, (i * Math.PI) / 36); c.lineTo(p.x, p.y); }
    c.stroke();
  }
  const way = Math.atan2(test.along[1], test.along[0]), tip = seen(0, way);
  c.strokeStyle = c.fillStyle = colours.ink;
  c.lineWidth = 1.5;
  c.beginPath();
  c.moveTo(x0, y0);
  c.lineTo(tip.x, tip.y);
  c.stroke();
  c.beginPath();
  c.arc(tip.x, tip.y, 3.5, 0, 7);
  c.fill();
  const most = Math.max(...facets.map((f) => f.load), 1e-300);
  const dots = facets.map((f) => {
    const u = Math.cos(a * Math.acos(Math.min(1, f.n[0])));
    return { ...seen(u, Math.atan2(f.n[2], f.n[1])), f };
  });
  for (const { x, y, f } of dots.sort((p, q) => q.back - p.back)) {
    c.beginPath();
    c.arc(x, y, f.load > 0 ? 3.5 + 7 * Math.sqrt(f.load / most) : 4, 0, 7);
    c.fillStyle = f.slides > 0.5 ? colours.sliding : colours.stuck;
    c.globalAlpha = 0.88;
    if (f.load > 0) c.fill();
    c.globalAlpha = 1;
    c.strokeStyle = f.load > 0 ? "#0004" : colours.separated;
    c.lineWidth = f.load > 0 ? 1 : 1.5;
    c.stroke();
  }
  c.fillStyle = colours.faint;
  c.textBaseline = "middle";
  c.textAlign = "left";
  c.fillText(`facets: top flat, rim ${Math.round(90 / a)}° steep`, 4, 10);
}

// -------------------------------------------------------------------------------- the two faces

/* Pixels for one metre in the scene, and of one asperity in width */
function frame(test) {
  const wide = part("scene").clientWidth, count = Math.max(4, 2 * Math.round(wide / 250)), pitch = wide / count;
  return { count, pitch, zoom: (0.5 * pitch - 12) / (REACH * test.joint.length) };
}
const zoomOf = (test) => frame(test).zoom;

/* Choose asperities that represent the joint: pairs of facets that face against the slip and with it,
 * with cells of all depths. gap: of the open joint */
function chooseTeeth(test, count) {
  const [ex, ey] = test.along, { virgin, joint } = test;
  const tilts = virgin.map((f) => Math.atan2(f.n[1] * ex + f.n[2] * ey, f.n[0]));
  const flat = virgin.map((f) => Math.abs(f.n[2] * ex - f.n[1] * ey));
  const order = tilts.map((_, i) => i).filter((i) => flat[i] < 0.6 * Math.abs(Math.sin(tilts[i])) + 0.05);
  const side = (sign) => { // not too steep for the picture, if possible
    const all = order.filter((i) => sign * tilts[i] > 1e-9).sort((i, j) => sign * (tilts[i] - tilts[j]));
    const low = all.filter((i) => Math.abs(tilts[i]) < 0.7);
    return low.length ? low : all.slice(0, 1);
  };
  const [up, down] = [side(1), side(-1)];
  return Array.from({ length: count }, (_, j) => {
    const of = j % 2 ? down : up, facet = of[((j >> 1) * 2 + (j >> 2)) % of.length];
    const near = virgin[facet].cells.filter((cell) => cell.gap < 1.5 * joint.length).length || 1;
    const cell = (j * 3 + (j >> 1)) % near;
    return { facet, cell, tilt: tilts[facet], n: virgin[facet].n, gap: virgin[facet].cells[cell].gap };
  });
}

/* Draw the two faces. Below, each ramp has the inclination of its facet, and ends where its dilation has decayed;
 * above, a tip hangs over each. Gaps, slip and closure of the law are enlarged by the same
 * factor; a tip in contact overlaps its ramp. mark: a state to highlight;
 * gear: motion of the block over motion of the pointer */
function drawScene(test, facets, mating, mark, gear) {
  const { c, wide, high } = canvas("scene"), { count, pitch, zoom } = frame(test);
  const { along, slip, at } = test, R = Math.min(9, pitch / 9), half = pitch / 2;
  const across = [at[1] - slip * along[0], at[2] - slip * along[1]]; // slip normal to the picture
  const climb = (tooth, way) => { // height of the ramp (m) at a slip, from the middle
    const p = along.map((e, i) => across[i] + way * e), size = Math.hypot(...p) / mating;
    return (tooth.n[1] * p[0] + tooth.n[2] * p[1]) / tooth.n[0] / Math.sqrt(1 + size * size);
  };
  let z = 0;
  const teeth = chooseTeeth(test, count + 2).map((tooth, j) => {
    const x = (j - 0.5) * pitch, ramp = Array.from({ length: 17 }, (_, i) => (i / 8 - 1) * half);
    const heights = ramp.map((px) => climb(tooth, px / zoom) * zoom), up = z - heights[0];
    z = heights.at(-1) + up;
    const above = tooth.gap * zoom + R, { tilt } = tooth;
    const tip = [x - Math.sin(tilt) * above + slip * zoom, up + Math.cos(tilt) * above - at[0] * zoom];
    return { ...tooth, x, tip, ground: ramp.map((px, i) => [x + px, heights[i] + up]) };
  });
  const ground = teeth.flatMap((t) => t.ground), peak = Math.max(...ground.map((p) => p[1]));
  const low = Math.min(...ground.map((p) => p[1])), base = high - 30 + low;
  const top = peak + R + 12 - at[0] * zoom + 0.9 * test.joint.length * zoom; // of the gaps in the upper block
  const Y = (height) => base - height;
  c.beginPath(); // the upper block with its tips
  c.moveTo(-20, -2);
  for (const { tip: [px, pz] } of teeth) {
    const foot = 0.42 * pitch;
    c.lineTo(px - foot, Y(top));
    c.quadraticCurveTo(px - R * 1.5, Y(top), px - R, Y(pz));
    c.arc(px, Y(pz), R, Math.PI, 0, true);
    c.quadraticCurveTo(px + R * 1.5, Y(top), px + foot, Y(top));
  }
  c.lineTo(wide + 20 + pitch, -2);
  c.closePath();
  c.fillStyle = colours.over;
  c.fill();
  c.strokeStyle = colours.faint;
  c.lineWidth = 1;
  c.stroke();
  c.beginPath();
  ground.forEach(([px, pz]) => c.lineTo(px, Y(pz)));
  c.lineTo(wide + pitch, high + 2);
  c.lineTo(-pitch, high + 2);
  c.closePath();
  c.fillStyle = colours.rock;
  c.fill();
  c.stroke();
  for (const { tip, facet, cell, tilt } of teeth) {
    const { gap, use } = facets[facet].cells[cell], [px, pz] = tip;
    const state = gap >= 0 ? "separated" : use >= 1 ? "sliding" : "stuck";
    const pressed = Math.min(2 * R, Math.max(0, -gap * zoom)), turn = Math.PI / 2 - tilt;
    c.strokeStyle = colours[state];
    c.lineWidth = 5;
    c.beginPath();
    if (gap >= 0) c.arc(px, Y(pz), R, turn - 0.9, turn + 0.9);
    else { // the face along which tip and ramp are pressed together
      const wideness = Math.max(0.55 * R, Math.sqrt(Math.max(0, R * R - (R - pressed) ** 2)));
      const [mx, mz] = [px + Math.sin(tilt) * (R - pressed), pz - Math.cos(tilt) * (R - pressed)];
      c.moveTo(mx - Math.cos(tilt) * wideness, Y(mz - Math.sin(tilt) * wideness));
      c.lineTo(mx + Math.cos(tilt) * wideness, Y(mz + Math.sin(tilt) * wideness));
    }
    c.stroke();
    if (mark !== state) continue;
    c.lineWidth = 1.5;
    c.beginPath();
    c.arc(px, Y(pz), R + 9, 0, 7);
    c.stroke();
  }
  c.fillStyle = colours.ink;
  c.textAlign = "center";
  c.textBaseline = "middle";
  const slowed = gear < 0.9 ? ` (slowed ${three(1 / gear)} times)` : "";
  const label = test.hold === "stress" ? `◄ drag this block${slowed} ►` : `◄ ▲ drag this block${slowed} ▼ ►`;
  c.fillText(label, wide / 2 + slip * zoom, 14);
  const [per, unit] = scale(test.joint.length), bar = niceStep((40 / zoom) * per, 1);
  c.fillRect(10, high - 8, (bar / per) * zoom, 3); // of the displacements
  c.textAlign = "left";
  c.fillText(`${three(bar)} ${unit}`, 16 + (bar / per) * zoom, high - 9);
}
