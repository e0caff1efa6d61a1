/**
 * Bodies on the graphics card: round cones and ellipsoids, all of a kind in one instanced draw.
 *
 * A round cone is one mesh of two caps: each vertex knows on which end's ball it lies, in which direction about the
 * axis, and how far from the pole to the circle at which the cone touches that ball. The vertex shader finds that
 * circle from the two radii, so surface and normals are exact whatever the cone; only centres and radii are sent.
 *
 * Light, lines and haze are those of the pictures (render/figure.py, render/solids.py); colours are written as they
 * are, without three.js's colour management.
 */

import {
  AddEquation,
  BackSide,
  CustomBlending,
  DynamicDrawUsage,
  Float32BufferAttribute,
  FrontSide,
  Group,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  InstancedInterleavedBuffer,
  InterleavedBufferAttribute,
  Mesh,
  MinEquation,
  NoBlending,
  OneFactor,
  ShaderMaterial,
  Vector3,
} from "three";

/** What bodies are drawn on, as `--paper` in player.css, the floor's grid on that, and the lightest of both. */
export const PAPERS = {
  light: { paper: [0.98, 0.976, 0.969], lit: [0.98, 0.976, 0.969], grid: [0.875, 0.868, 0.857] },
  dark: { paper: [0.106, 0.102, 0.118], lit: [0.25, 0.246, 0.262], grid: [0.25, 0.246, 0.262] },
};

/** Uniforms of the paper, for all materials on one stage. */
export function paperUniforms() {
  return { paper: { value: new Vector3() }, lit: { value: new Vector3() }, grid: { value: new Vector3() } };
}

/** Segments about a solid's axis, and from its pole to its widest circle, or to that where cone and ball touch. */
export const FINE = { cone: { around: 12, cap: 3 }, ball: { around: 16, cap: 5 } };
export const COARSE = { cone: { around: 8, cap: 2 }, ball: { around: 12, cap: 4 } };
export const TUBE = { cone: { around: 6, cap: 1 } };

const STEP = 0.016; // metres by which something must stand before another for a line between them
const HEAD_STEP = 0.06; // face and hair: a nose has no line round it, unless it is seen against something else
const AHEAD = 0.006; // metres that the last cone is drawn nearer than the first: which limb is seen where two join
const LINE = 1.3; // width of lines in CSS pixels

const VERTEX = {
  cone: /* glsl */ `
    attribute vec4 a, b; // centres and radii
    void surface(out vec3 place, out vec3 normal) {
      vec3 along = b.xyz - a.xyz;
      float span = length(along);
      vec3 axis = span > 1e-9 ? along / span : vec3(0.0, 1.0, 0.0);
      vec3 u = normalize(cross(axis, abs(axis.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0)));
      float circle = asin(clamp((a.w - b.w) / max(span, 1e-9), -1.0, 1.0)); // its latitude
      float share = length(position.xy);
      float latitude = mix(position.z < 0.5 ? -1.5707963 : 1.5707963, circle, share);
      vec2 around = position.xy / max(share, 1e-6);
      normal = sin(latitude) * axis + cos(latitude) * (around.x * u + around.y * cross(axis, u));
      place = position.z < 0.5 ? a.xyz + a.w * normal : b.xyz + b.w * normal;
    }
    float lowest() {
      return min(a.y - a.w, b.y - b.w);
    }`,
  ball: /* glsl */ `
    attribute vec3 centre, axisX, axisY, axisZ;
    void surface(out vec3 place, out vec3 normal) {
      place = centre + position.x * axisX + position.y * axisY + position.z * axisZ;
      vec3 square = vec3(dot(axisX, axisX), dot(axisY, axisY), dot(axisZ, axisZ));
      normal = normalize(mat3(axisX, axisY, axisZ) * (position / square));
    }
    float lowest() {
      return centre.y - length(vec3(axisX.y, axisY.y, axisZ.y));
    }`,
};

const PASSES = {
  solid: {
    vertex: /* glsl */ `
      attribute vec3 paint;
      attribute float strength, ahead;
      varying vec3 vPaint, vNormal, vSeen;
      varying float vStrength;
      void main() {
        vec3 place;
        surface(place, vNormal);
        vec4 seen = viewMatrix * vec4(place, 1.0);
        seen.xyz *= 1.0 - ahead / length(seen.xyz);
        vSeen = seen.xyz;
        vPaint = paint;
        vStrength = strength;
        gl_Position = projectionMatrix * seen;
      }`,
    fragment: /* glsl */ `
      uniform vec3 paper, middle;
      uniform float depth;
      varying vec3 vPaint, vNormal, vSeen;
      varying float vStrength;
      void main() {
        vec3 towards = normalize(vec3(viewMatrix[0].z, viewMatrix[1].z, viewMatrix[2].z));
        vec3 light = normalize(vec3(0.0, 0.6, 0.0) + 0.8 * towards);
        float shade = 0.62 + 0.38 * max(dot(normalize(vNormal), light), 0.0);
        float nearer = vSeen.z - (viewMatrix * vec4(middle, 1.0)).z;
        float haze = 0.30 * clamp(0.5 - nearer / (0.9 * depth), 0.0, 1.0);
        gl_FragColor = vec4(mix(paper, mix(vPaint * shade, vec3(1.0), haze), vStrength), 1.0);
      }`,
    options: { side: FrontSide, blending: NoBlending },
  },
  // The back of a body that is a line's width thicker, and a step farther away: it shows round what stands before
  // something by that step, and nowhere else.
  line: {
    vertex: /* glsl */ `
      attribute float strength, step;
      uniform float width; // of a line, by the distance from the viewer
      varying float vStrength;
      void main() {
        vec3 place, normal;
        surface(place, normal);
        vec4 seen = viewMatrix * vec4(place, 1.0);
        seen.xyz += mat3(viewMatrix) * normal * width * -seen.z;
        seen.xyz *= 1.0 + step / length(seen.xyz);
        vStrength = strength;
        gl_Position = projectionMatrix * seen;
      }`,
    fragment: /* glsl */ `
      uniform vec3 paper, ink;
      varying float vStrength;
      void main() {
        gl_FragColor = vec4(mix(paper, ink, vStrength), 1.0);
      }`,
    options: { side: BackSide, blending: NoBlending },
  },
  // What looks down, flattened on the floor: the darker the nearer, softer and wider the higher. Of what overlaps the
  // darkest counts, so nothing darkens twice.
  shadow: {
    vertex: /* glsl */ `
      uniform float size;
      varying float vDark;
      void main() {
        if (lowest() > 0.8 * size) { // so high that nothing would be seen of it
          gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
          return;
        }
        vec3 place, normal;
        surface(place, normal);
        float height = max(place.y, 0.0);
        vDark = exp(-height / (0.2 * size)) * min(-1.4 * normal.y, 1.0);
        vec2 spread = normal.xz * (0.02 * size + 0.3 * height);
        gl_Position = projectionMatrix * viewMatrix * vec4(place.x + spread.x, 0.0, place.z + spread.y, 1.0);
      }`,
    fragment: /* glsl */ `
      uniform vec3 lit;
      varying float vDark;
      void main() {
        gl_FragColor = vec4(lit * (1.0 - vDark * vec3(0.50, 0.51, 0.52)), 1.0);
      }`,
    options: {
      side: BackSide, // flattened, what looked down looks up
      depthTest: false,
      depthWrite: false,
      blending: CustomBlending,
      blendEquation: MinEquation,
      blendEquationAlpha: AddEquation,
      blendSrc: OneFactor,
      blendDst: OneFactor,
    },
  },
};

/** Up to `count` bodies that are drawn alike. Postures are put in with `set`; `show` says how many are drawn. */
export class Figures {
  /**
   * @param {Body} body
   * @param {number} count of bodies, at most
   * @param {object} mesh FINE or COARSE
   * @param {object} colours ink, bridged, and palettes by name: paint -> [red, green, blue], 0 to 255; `dancers` is a
   *   list of them
   * @param {object} papers what paperUniforms made
   */
  constructor(body, count, mesh, colours, papers) {
    this.body = body;
    this.palettes = {};
    for (const [name, palette] of Object.entries({ given: colours.given, inserted: colours.inserted, ...colours.dancers })) {
      this.palettes[name] = {
        cone: body.cones.flatMap((cone) => palette[cone.paint].map((value) => value / 255)),
        ball: body.balls.flatMap((ball) => palette[ball.paint].map((value) => value / 255)),
      };
    }
    this.uniforms = {
      size: { value: body.size },
      depth: { value: body.size }, // of all that is drawn, over which haze thickens
      middle: { value: new Vector3() },
      width: { value: 0 },
      ink: { value: new Vector3(...colours.ink).divideScalar(255) },
      ...papers,
    };
    const ahead = body.cones.map((_, i) => (AHEAD * body.size * i) / body.cones.length);
    this.cones = new Instances("cone", count, mesh, this.uniforms, { step: steps(body.cones, body.size), ahead });
    this.balls = new Instances("ball", count, mesh, this.uniforms, { step: steps(body.balls, body.size) });
    this.group = new Group().add(this.cones.solid, this.balls.solid, this.cones.line, this.balls.line);
    this.shadows = new Group().add(this.cones.shadow, this.balls.shadow);
  }

  /**
   * Make the body at `index` the one that `body` is posed as.
   * @param {string | number} palette "given", "inserted", or a dancer's number
   * @param {number} strength from 0, as pale as paper, to 1
   */
  set(index, palette, strength = 1) {
    const { cones, balls } = this.body;
    this.body.writeCones(this.cones.places.array, index * cones.length * 8);
    this.body.writeBalls(this.balls.places.array, index * balls.length * 12);
    this.cones.colour(index * cones.length, this.palettes[palette].cone, strength);
    this.balls.colour(index * balls.length, this.palettes[palette].ball, strength);
  }

  /** Draw the first `count` bodies. */
  show(count) {
    this.cones.show(count * this.body.cones.length);
    this.balls.show(count * this.body.balls.length);
  }

  /** How large a CSS pixel is at distance 1 from the viewer. */
  set pixel(value) {
    this.uniforms.width.value = LINE * value;
  }
}

/** Balls that stand out around joints. */
export class Marks {
  constructor(body, colour, uniforms) {
    this.body = body;
    this.balls = new Instances("ball", 1, FINE, uniforms, { step: body.marks.map(() => STEP * body.size) });
    const paints = body.marks.flatMap(() => colour.map((value) => value / 255));
    this.balls.colour(0, paints, 1);
    this.group = new Group().add(this.balls.solid, this.balls.line);
  }

  /** Mark these joints, by their indices, of the posture that the body is in. */
  show(joints) {
    const places = this.balls.places.array;
    joints.forEach((joint, i) => {
      const radius = this.body.marks[joint];
      places.fill(0, i * 12, i * 12 + 12);
      for (let k = 0; k < 3; k++) {
        places[i * 12 + k] = this.body.joints[joint * 3 + k];
        places[i * 12 + 3 + 4 * k] = radius;
      }
    });
    this.balls.show(joints.length);
  }
}

/** By how many metres each of the solids must stand before another for a line between them. */
function steps(solids, size) {
  return solids.map(({ paint }) => (paint === "face" || paint === "hair" ? HEAD_STEP : STEP) * size);
}

/** The meshes of one kind of solid in up to `bodies` bodies: `solid`, `line` and `shadow` share one geometry. */
export class Instances {
  /** `step`, and `ahead` if it is not 0, are what each solid of a body has. */
  constructor(kind, bodies, mesh, uniforms, { step, ahead = step.map(() => 0) }) {
    const count = bodies * step.length;
    const geometry = new InstancedBufferGeometry();
    const [vertices, triangles] = kind === "cone" ? coneMesh(mesh.cone) : ballMesh(mesh.ball);
    geometry.setAttribute("position", new Float32BufferAttribute(vertices, 3));
    geometry.setIndex(triangles);
    const parts = kind === "cone" ? { a: 4, b: 4 } : { centre: 3, axisX: 3, axisY: 3, axisZ: 3 };
    const stride = Object.values(parts).reduce((sum, size) => sum + size, 0);
    this.places = new InstancedInterleavedBuffer(new Float32Array(count * stride), stride);
    this.places.setUsage(DynamicDrawUsage);
    let offset = 0;
    for (const [name, size] of Object.entries(parts)) {
      geometry.setAttribute(name, new InterleavedBufferAttribute(this.places, size, offset));
      offset += size;
    }
    this.paint = new InstancedBufferAttribute(new Float32Array(count * 3), 3);
    this.strength = new InstancedBufferAttribute(new Float32Array(count), 1);
    geometry.setAttribute("paint", this.paint);
    geometry.setAttribute("strength", this.strength);
    for (const [name, values] of Object.entries({ step, ahead })) {
      const repeated = Array.from({ length: bodies }, () => values).flat();
      geometry.setAttribute(name, new InstancedBufferAttribute(new Float32Array(repeated), 1));
    }
    this.geometry = geometry;
    for (const [name, { vertex, fragment, options }] of Object.entries(PASSES)) {
      const material = new ShaderMaterial({
        vertexShader: VERTEX[kind] + vertex,
        fragmentShader: fragment,
        uniforms,
        ...options,
      });
      this[name] = new Mesh(geometry, material);
      this[name].frustumCulled = false; // nobody knows its bounds but the shader
    }
    this.show(0);
  }

  colour(first, colours, strength) {
    this.paint.array.set(colours, first * 3);
    this.strength.array.fill(strength, first, first + colours.length / 3);
    this.paint.needsUpdate = true;
    this.strength.needsUpdate = true;
  }

  show(count) {
    this.geometry.instanceCount = count;
    this.places.needsUpdate = true;
    for (const mesh of [this.solid, this.line, this.shadow]) mesh.visible = count > 0;
  }
}

/** Of each vertex: its direction about the axis, as long as its share of the way from pole to circle; which end. */
function coneMesh({ around, cap }) {
  const rings = [];
  for (let i = 0; i <= cap; i++) rings.push([i / cap, 0]);
  for (let i = cap; i >= 0; i--) rings.push([i / cap, 1]);
  const vertices = rings.flatMap(([share, end]) =>
    azimuths(around).flatMap((azimuth) => [share * Math.cos(azimuth), share * Math.sin(azimuth), end]),
  );
  return [vertices, triangles(rings.length, around)];
}

/** Places on the unit ball, ring by ring from pole to pole. */
function ballMesh({ around, cap }) {
  const latitudes = Array.from({ length: 2 * cap + 1 }, (_, i) => ((i / cap - 1) * Math.PI) / 2);
  const vertices = latitudes.flatMap((latitude) =>
    azimuths(around).flatMap((azimuth) => [
      Math.cos(latitude) * Math.cos(azimuth),
      Math.cos(latitude) * Math.sin(azimuth),
      Math.sin(latitude),
    ]),
  );
  return [vertices, triangles(latitudes.length, around)];
}

function azimuths(around) {
  return Array.from({ length: around }, (_, i) => (2 * Math.PI * i) / around);
}

/** Triangles between rings of vertices, counter-clockwise from outside, without the empty ones at a pole. */
function triangles(rings, around) {
  const corners = [];
  for (let ring = 0; ring + 1 < rings; ring++) {
    for (let i = 0; i < around; i++) {
      const [a, b] = [ring * around + i, ring * around + ((i + 1) % around)];
      if (ring > 0) corners.push(a, b, b + around);
      if (ring + 2 < rings) corners.push(a, b + around, a + around);
    }
  }
  return corners;
}
