"use strict";
// The view as a page: its data are in elements of the page, the keyboard is that of the window.
(() => {
  const text = (id) => document.getElementById(id).textContent, spec = JSON.parse(text("spec"));
  const scenes = spec.scenes.map((id) => readScene(decoded(text(id))));
  window.view = mountView(document.querySelector(".view"), { spec, scenes, licence: text("licence") }, window);
})();
