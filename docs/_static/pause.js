/* Animated pictures pause: a click, or the space bar, stops them on the frame that is shown, and starts
 * them again. They begin stopped where the reader asks for less motion. */
"use strict";

function pausing(image) {
  const still = document.createElement("canvas"), box = document.createElement("button");
  const stop = () => {
    [still.width, still.height] = [image.naturalWidth, image.naturalHeight];
    still.getContext("2d").drawImage(image, 0, 0);
    show(true);
  };
  const show = (stopped) => {
    [image.hidden, still.hidden] = [stopped, !stopped];
    box.title = box.ariaLabel = `${stopped ? "Play" : "Pause"}: ${image.alt}`;
    box.dataset.state = stopped ? "▶" : "❚❚";
  };
  box.className = "pausing";
  box.type = "button";
  image.replaceWith(box);
  box.append(image, still);
  box.onclick = () => (image.hidden ? show(false) : stop());
  show(false);
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) image.decode().then(stop);
}

document.addEventListener("DOMContentLoaded", () => {
  for (const image of document.querySelectorAll('article img[src$=".gif"]')) pausing(image);
});
