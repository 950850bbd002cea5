// A triangle surface as three.js draws it: corners of their own, so that values per triangle stay per triangle.
import * as THREE from 'three';
import {kNoValueColour} from './colours.js';

function vertexNormals(points, triangles) {
  const normals = new Float32Array(points.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
    const [ux, uy, uz] = [points[b] - points[a], points[b + 1] - points[a + 1], points[b + 2] - points[a + 2]];
    const [vx, vy, vz] = [points[c] - points[a], points[c + 1] - points[a + 1], points[c + 2] - points[a + 2]];
    const n = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const corner of [a, b, c]) for (let k = 0; k < 3; ++k) normals[corner + k] += n[k];
  }
  return normals;
}

export function surfaceGeometry(points, triangles) {
  const normals = vertexNormals(points, triangles);
  const position = new Float32Array(3 * triangles.length);
  const normal = new Float32Array(3 * triangles.length);
  triangles.forEach((vertex, corner) => {
    const size = Math.hypot(normals[3 * vertex], normals[3 * vertex + 1], normals[3 * vertex + 2]) || 1;
    for (let k = 0; k < 3; ++k) {
      position[3 * corner + k] = points[3 * vertex + k];
      normal[3 * corner + k] = normals[3 * vertex + k] / size;
    }
  });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(position, 3));
  geometry.setAttribute('normal', new THREE.BufferAttribute(normal, 3));
  geometry.setAttribute('uv', new THREE.BufferAttribute(new Float32Array(2 * triangles.length), 2));
  return geometry;
}

/** Values per vertex or per triangle; u is the place in the colour table, v tells whether there is a value. */
export function paint(geometry, triangles, values, perTriangle, low, high) {
  const uv = geometry.getAttribute('uv');
  for (let corner = 0; corner < triangles.length; ++corner) {
    const value = values[perTriangle ? Math.floor(corner / 3) : triangles[corner]];
    const share = high > low ? (value - low) / (high - low) : 0;
    uv.setXY(corner, Number.isNaN(value) ? 0 : Math.min(Math.max(share, 0), 1), Number.isNaN(value) ? 1 : 0);
  }
  uv.needsUpdate = true;
}

/** The first row holds the colours, the second the one for no value. */
export function colourTexture(table) {
  const bytes = new Uint8Array(2 * table.length);
  bytes.set(table);
  for (let i = 0; i < 256; ++i) bytes.set([...kNoValueColour, 255], table.length + 4 * i);
  const texture = new THREE.DataTexture(bytes, 256, 2);
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.magFilter = texture.minFilter = THREE.NearestFilter;
  texture.needsUpdate = true;
  return texture;
}

/** See-through walls are denser where they are seen edge-on, as glass is: that shows their shape. */
export function wallMaterial(options) {
  const material = new THREE.MeshLambertMaterial(options);
  material.onBeforeCompile = (shader) => {
    shader.fragmentShader = shader.fragmentShader.replace('#include <opaque_fragment>', `
      float facing = abs(dot(normalize(normal), normalize(vViewPosition)));
      diffuseColor.a = mix(diffuseColor.a, 1.0, diffuseColor.a * pow(1.0 - facing, 2.0));
      #include <opaque_fragment>`);
  };
  return material;
}
