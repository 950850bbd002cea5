// The three-dimensional view: layers, camera, picking. Draws only when something changed.
import * as THREE from 'three';
import {TrackballControls} from 'three/examples/jsm/controls/TrackballControls.js';
import {byId, number} from './format.js';
import {colourTexture, paint, surfaceGeometry, wallMaterial} from './surface.js';
import {across, cross, minus, norm, plus, point, scaled, unit} from './vector.js';

const kColours = {wall: 0xcc5c54, before: 0x8a97a3, stent: 0x93a6ba, struts: 0x27405c, centerline: 0x1d2733,
  ringBefore: 0x5d6974, ringAfter: 0xa82a22};
const kWhite = 0xffffff;
const kOutwards = 0.005;  // of the view's size

export class View {
  constructor(home, look) {
    this.home = home;
    this.renderer = new THREE.WebGLRenderer({antialias: true, alpha: false, preserveDrawingBuffer: true});
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setClearColor(kWhite);
    this.renderer.localClippingEnabled = true;
    home.prepend(this.renderer.domElement);
    this.scene = new THREE.Scene();
    this.camera = new THREE.OrthographicCamera(-1, 1, 1, -1, -look.depth, look.depth);
    const headlight = new THREE.DirectionalLight(kWhite, 1.7);
    headlight.position.set(0.3, 0.4, 1);
    this.camera.add(headlight);
    this.scene.add(this.camera, new THREE.AmbientLight(kWhite, 1.55));
    this.cutPlane = new THREE.Plane();
    this.layers = {before: new THREE.Group(), wall: new THREE.Group(), stent: new THREE.Group(), struts: new THREE.Group(),
      centerline: new THREE.Group(), station: new THREE.Group()};
    this.scene.add(...Object.values(this.layers));
    this.shown = {before: false, wall: true, stent: true, struts: false, centerline: false, station: true};
    this.opacity = 0.5;
    this.cutOpen = false;
    this.mode = 'overlay';
    this.look = look;
    this.controls = new TrackballControls(this.camera, this.renderer.domElement);
    this.controls.rotateSpeed = 3;
    this.controls.dynamicDampingFactor = 0.25;
    this.controls.addEventListener('change', () => { this.dirty = true; });
    new ResizeObserver(() => this.resize()).observe(home);
    this.resize();
    this.focus(look.centre, look.size);
    const frame = () => {
      this.controls.update();
      if (this.dirty) this.draw();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.home;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height);
    this.controls.handleResize();
    this.frameCamera();
  }

  frameCamera() {
    const {clientWidth: width, clientHeight: height} = this.home;
    const panels = this.mode === 'side' ? 2 : 1;
    const half = 0.5 * (this.height ?? 1);
    const wide = half * width / panels / height;
    Object.assign(this.camera, {left: -wide, right: wide, top: half, bottom: -half});
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  /** Puts what lies within `size` (mm) of `centre` into view, from the direction that shows the bend. */
  focus(centre, size) {
    const {up, direction} = this.look;
    this.height = 1.08 * size * Math.max(1, (this.mode === 'side' ? 2 : 1) * this.home.clientHeight / this.home.clientWidth);
    this.camera.zoom = 1;
    this.controls.target.set(...centre);
    this.camera.position.set(...plus(centre, direction, -size));
    this.camera.up.set(...up);
    this.camera.lookAt(...centre);
    this.frameCamera();
  }

  meshes(layer, geometry, options, seeThrough) {
    const group = this.layers[layer];
    for (const child of group.children) {
      child.geometry.dispose();
      child.material.map?.dispose();
      child.material.dispose();
    }
    group.clear();
    if (!geometry) return;
    for (const side of seeThrough ? [THREE.BackSide, THREE.FrontSide] : [THREE.DoubleSide]) {
      const material = seeThrough ? wallMaterial({...options, side, ...this.outwards(side)}) : new THREE.MeshPhongMaterial({...options, side});
      const mesh = new THREE.Mesh(geometry, material);
      mesh.renderOrder = (layer === 'wall' ? 2 : 0) + (side === THREE.FrontSide ? 1 : 0);
      group.add(mesh);
    }
    this.applyCut();
  }

  /** The wall lies on the metal: drawn a little farther out than it is, seen from either side, it does not flicker. */
  outwards(side) {
    const sign = side === THREE.FrontSide ? -1 : 1;
    const unit = 2 * this.look.depth / 2 ** 24;
    return {polygonOffset: true, polygonOffsetFactor: sign, polygonOffsetUnits: sign * kOutwards * this.look.size / unit};
  }

  setBefore({points, triangles}) {
    this.meshes('before', surfaceGeometry(points, triangles), {transparent: true, depthWrite: false}, true);
    this.styleBefore(false);
    this.dirty = true;
  }

  /** A ghost beside the wall after, or the wall itself in a view of its own. */
  styleBefore(alone) {
    for (const {material} of this.layers.before.children) {
      material.color.set(alone ? kColours.wall : kColours.before);
      material.opacity = alone ? this.opacity : 0.3;
    }
  }

  /** `field`: {values, perTriangle, low, high, table} or null for the plain wall. */
  setWall({points, triangles}, field) {
    const geometry = surfaceGeometry(points, triangles);
    const options = {color: kColours.wall};
    if (field) {
      paint(geometry, triangles, field.values, field.perTriangle, field.low, field.high);
      Object.assign(options, {color: kWhite, map: colourTexture(field.table)});
    }
    this.meshes('wall', geometry, options, true);
    this.wallMesh = {points, triangles};
    this.applyOpacity();
  }

  setStent(surface) {
    this.meshes('stent', surface && surfaceGeometry(surface.points, surface.triangles),
      {color: kColours.stent, specular: 0x444444, shininess: 40}, false);
    this.dirty = true;
  }

  setLines(layer, list) {
    const material = new THREE.LineBasicMaterial({color: kColours[layer], depthTest: layer !== 'centerline'});
    for (const line of list) {
      const geometry = new THREE.BufferGeometry().setAttribute('position', new THREE.BufferAttribute(line, 3));
      const drawn = new THREE.Line(geometry, material);
      drawn.renderOrder = 9;
      this.layers[layer].add(drawn);
    }
    this.dirty = true;
  }

  /** Marks a station by the outlines of its cross-section. */
  setStation(place, radius) {
    const group = this.layers.station;
    for (const child of group.children) child.geometry.dispose();
    group.clear();
    for (const [outline, color] of [[place?.before, kColours.ringBefore], [place?.after, kColours.ringAfter]]) {
      if (!outline) continue;
      const curve = new THREE.CatmullRomCurve3(
        Array.from({length: outline.length / 3}, (_, i) => new THREE.Vector3(...point(outline, i))), true);
      const geometry = new THREE.TubeGeometry(curve, Math.min(outline.length, 240), radius, 6, true);
      const ring = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({color, depthTest: false, transparent: true, opacity: 0.9}));
      ring.renderOrder = 10;
      group.add(ring);
    }
    this.dirty = true;
  }

  applyOpacity() {
    for (const {material} of this.layers.wall.children) {
      const opaque = this.opacity > 0.99;
      Object.assign(material, {opacity: this.opacity, transparent: !opaque, depthWrite: opaque, needsUpdate: true});
    }
    this.dirty = true;
  }

  /** Takes the half before the stent's middle away, as seen from where the viewer stands. */
  applyCut() {
    for (const layer of ['before', 'wall', 'stent']) {
      for (const {material} of this.layers[layer].children) {
        Object.assign(material, {clippingPlanes: this.cutOpen ? [this.cutPlane] : null, needsUpdate: true});
      }
    }
    this.dirty = true;
  }

  setMode(mode) {
    this.mode = mode;
    this.focus(this.controls.target.toArray(), this.height / 1.08);
  }

  draw() {
    this.dirty = false;
    const {clientWidth: width, clientHeight: height} = this.home;
    const toEye = this.camera.position.clone().sub(this.controls.target).normalize();
    this.cutPlane.setFromNormalAndCoplanarPoint(toEye.negate(), new THREE.Vector3(...this.look.centre));
    const show = (layers) => {
      for (const [name, group] of Object.entries(this.layers)) group.visible = layers[name];
    };
    this.renderer.setScissorTest(true);
    if (this.mode === 'side') {
      const half = Math.floor(width / 2);
      this.styleBefore(true);
      this.part(0, half, height, () => show({...this.shown, before: true, wall: false, stent: false, struts: false}));
      this.part(half, width - half, height, () => show({...this.shown, before: false}));
      this.styleBefore(false);
    } else {
      this.part(0, width, height, () => show(this.shown));
    }
    this.drawScaleBar();
  }

  part(left, width, height, prepare) {
    prepare();
    this.renderer.setViewport(left, 0, width, height);
    this.renderer.setScissor(left, 0, width, height);
    this.renderer.render(this.scene, this.camera);
  }

  drawScaleBar() {
    const perPixel = this.height / this.camera.zoom / this.home.clientHeight;
    const wanted = 110 * perPixel;
    const decade = 10 ** Math.floor(Math.log10(wanted));
    const bar = decade * (wanted >= 5 * decade ? 5 : wanted >= 2 * decade ? 2 : 1);
    byId('scale-bar').style.width = `${bar / perPixel}px`;
    byId('scale-bar').firstElementChild.textContent = `${number(bar)} mm`;
  }

  /** The wall under the pointer: {triangle, vertex, position}, or null. */
  pick(event) {
    const box = this.renderer.domElement.getBoundingClientRect();
    let x = (event.clientX - box.left) / box.width;
    const y = (event.clientY - box.top) / box.height;
    if (this.mode === 'side') x = x < 0.5 ? 2 * x : 2 * x - 1;
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2(2 * x - 1, 1 - 2 * y), this.camera);
    const front = this.layers.wall.children.find((mesh) => mesh.material.side === THREE.FrontSide);
    if (!front || !this.shown.wall) return null;
    const hits = ray.intersectObject(front, false).filter((hit) => !this.cutOpen || this.cutPlane.distanceToPoint(hit.point) >= 0);
    if (hits.length === 0) return null;
    const {faceIndex, point: place} = hits[0];
    const position = place.toArray();
    const corners = [0, 1, 2].map((k) => this.wallMesh.triangles[3 * faceIndex + k]);
    const distance = (v) => norm(minus(point(this.wallMesh.points, v), position));
    const vertex = corners.reduce((best, v) => (distance(v) < distance(best) ? v : best));
    return {triangle: faceIndex, vertex, position};
  }

  picture() {
    this.draw();
    return this.renderer.domElement.toDataURL('image/png');
  }
}

/** Looks across the plane in which `line` (points) bends most, its direction upright. */
export function lookAlong(line, centre, size) {
  const first = line[0], last = line[line.length - 1];
  const up = unit(minus(first, last));
  let [a, b] = [across(up, [1, 0, 0]), null];
  b = cross(up, a);
  let [aa, ab, bb] = [0, 0, 0];
  for (const p of line) {
    const offset = minus(p, centre);
    const x = offset[0] * a[0] + offset[1] * a[1] + offset[2] * a[2];
    const y = offset[0] * b[0] + offset[1] * b[1] + offset[2] * b[2];
    [aa, ab, bb] = [aa + x * x, ab + x * y, bb + y * y];
  }
  const angle = 0.5 * Math.atan2(2 * ab, aa - bb);
  const sideways = plus(scaled(a, Math.cos(angle)), b, Math.sin(angle));
  return {up, direction: cross(up, sideways), centre, size};
}
