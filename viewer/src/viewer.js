// Orbits around a building: the model and what is written over it come with the page.
import {
  AmbientLight, Box3, Color, DirectionalLight, HemisphereLight, PerspectiveCamera, Plane, Scene,
  SRGBColorSpace, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const facts = JSON.parse(document.getElementById("facts").textContent);
const element = (id) => document.getElementById(id);

function bytesOfModel() {
  const text = atob(element("model").textContent.trim());
  const bytes = new Uint8Array(text.length);
  for (let at = 0; at < text.length; at += 1) bytes[at] = text.charCodeAt(at);
  return bytes.buffer;
}

function fail(message) {
  element("message").textContent = message;
  element("message").hidden = false;
}

function makeRenderer() {
  try {
    const renderer = new WebGLRenderer({ antialias: true });
    renderer.outputColorSpace = SRGBColorSpace;
    renderer.localClippingEnabled = true;
    renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    return renderer;
  } catch (error) {
    fail("This browser shows no 3-D graphics (WebGL). Switch hardware acceleration on, or open "
      + "mesh.glb in another viewer.");
    return null;
  }
}

function light(scene) {
  scene.add(new AmbientLight(0xffffff, 1.1), new HemisphereLight(0xffffff, 0x8a8378, 1.2));
  const sun = new DirectionalLight(0xfff4e2, 1.1);
  sun.position.set(0.6, 1, 0.35);
  scene.add(sun);
}

function addLabels() {
  return facts.rooms.map((room) => {
    const label = document.createElement("span");
    label.textContent = room.name;
    element("labels").append(label);
    return { label, place: new Vector3(room.x_m, 0.1, -room.y_m) };
  });
}

function moveLabels(labels, camera, size) {
  const shown = element("names").checked;
  for (const { label, place } of labels) {
    const at = place.clone().project(camera);
    label.hidden = !shown || at.z > 1;
    label.style.transform = `translate(-50%, -50%) translate(${((at.x + 1) / 2) * size.x}px, `
      + `${((1 - at.y) / 2) * size.y}px)`;
  }
}

function start(renderer, model) {
  const scene = new Scene();
  scene.background = new Color(0xeceff2);
  scene.add(model);
  light(scene);
  const box = new Box3().setFromObject(model);
  const center = box.getCenter(new Vector3());
  const reach = box.getSize(new Vector3()).length();
  const camera = new PerspectiveCamera(45, 1, reach / 2000, reach * 20);
  const controls = new OrbitControls(camera, renderer.domElement);
  controls.maxDistance = reach * 4;
  controls.zoomToCursor = true;
  const reset = () => {
    controls.target.copy(center);
    camera.position.copy(center).add(new Vector3(-0.2, 0.95, 0.55).multiplyScalar(reach * 1.05));
    controls.update();
  };

  const cut = new Plane(new Vector3(0, -1, 0), 0);
  const ceilings = [];
  model.traverse((part) => {
    if (part.material) part.material.clippingPlanes = [cut];
    if (part.name === "ceiling") ceilings.push(part);
  });
  const labels = addLabels();
  const size = { x: 1, y: 1 };
  const draw = () => {
    cut.constant = box.min.y + Number(element("cut").value) / 100 * (box.max.y - box.min.y + 0.01);
    for (const ceiling of ceilings) ceiling.visible = element("ceiling").checked;
    renderer.render(scene, camera);
    moveLabels(labels, camera, size);
  };
  const resize = () => {
    size.x = window.innerWidth;
    size.y = window.innerHeight;
    renderer.setSize(size.x, size.y);
    camera.aspect = size.x / size.y;
    camera.updateProjectionMatrix();
    draw();
  };
  controls.addEventListener("change", draw);
  window.addEventListener("resize", resize);
  for (const id of ["cut", "ceiling", "names"]) element(id).addEventListener("input", draw);
  element("reset").addEventListener("click", () => { reset(); draw(); });
  reset();
  resize();
  document.body.dataset.ready = "yes";
}

const renderer = makeRenderer();
if (renderer) {
  element("view").append(renderer.domElement);
  renderer.domElement.setAttribute("role", "img");
  renderer.domElement.setAttribute("aria-label", `The building ${facts.name} in 3-D`);
  new GLTFLoader().parse(bytesOfModel(), "", (file) => start(renderer, file.scene),
    (error) => fail(`The model cannot be read: ${error.message}`));
}
