// Keeps the plan and the belief strip in step with the film. Without it the page still reads.
"use strict";
(() => {
  const drive = JSON.parse(document.getElementById("drive").textContent);
  const film = document.querySelector("video");
  const robot = document.querySelector("#hero .robot");
  const strip = document.querySelector(".strip");
  const cursor = strip.querySelector(".cursor");
  const seek = strip.querySelector(".seek");
  const edges = new Map();
  document.querySelectorAll("#hero [data-edge]").forEach((element) => {
    edges.set(element.dataset.edge, element);
  });
  let lit = [];
  let shown = -1;

  function show(step) {
    if (step === shown) return;
    shown = step;
    const [x, y, turn] = drive.poses[step];
    robot.setAttribute("transform", `translate(${x} ${y}) rotate(${turn})`);
    robot.removeAttribute("hidden");
    const at = drive.left + ((step + 0.5) / drive.poses.length) * drive.width;
    cursor.setAttribute("x1", at);
    cursor.setAttribute("x2", at);
    lit.forEach((element) => {
      element.classList.remove("believed");
      element.style.removeProperty("stroke-width");
    });
    lit = [];
    drive.beliefs[step].forEach(([edge, probability]) => {
      const element = edges.get(drive.edges[edge]);
      if (!element) return;
      element.classList.add("believed");
      element.style.strokeWidth = 4 + 12 * probability;
      lit.push(element);
    });
  }

  function follow() {
    const step = Math.floor(film.currentTime * drive.fps + 0.001);
    show(Math.max(0, Math.min(drive.poses.length - 1, step)));
    requestAnimationFrame(follow);
  }

  seek.addEventListener("click", (event) => {
    const box = seek.getBoundingClientRect();
    film.currentTime = ((event.clientX - box.left) / box.width) * (drive.poses.length / drive.fps);
    film.pause();
  });
  requestAnimationFrame(follow);
})();
