// SPDX-License-Identifier: BSD-3-Clause
/** Two ways to draw points: on the CPU, or with WebGL where there is a GPU. */
import {
  BufferAttribute,
  BufferGeometry,
  DataTexture,
  Matrix4,
  Points,
  RGBAFormat,
  Scene,
  ShaderMaterial,
  UnsignedByteType,
  Vector2,
  Vector4,
  WebGLRenderer,
} from "three";
import type { PerspectiveCamera } from "three";
import { Raster } from "../raster";
import type { Painted, Window3 } from "../raster";
import type { Rgb } from "../colours";
import { abgr } from "../colours";

export interface Painter {
  readonly canvas: HTMLCanvasElement;
  readonly name: string;
  resize(width: number, height: number, ratio: number): void;
  /** `clouds` by name, `view` as Raster.draw() takes it. `light`: with shaded edges. */
  draw(
    clouds: Map<string, Painted>,
    view: ArrayLike<number>,
    camera: PerspectiveCamera,
    window: Window3,
    background: Rgb,
    light: boolean,
  ): void;
}

export class CpuPainter implements Painter {
  readonly canvas = document.createElement("canvas");
  readonly name = "CPU";
  private raster = new Raster();
  private context = this.canvas.getContext("2d", { alpha: false })!;
  private image: ImageData | null = null;

  resize(width: number, height: number): void {
    this.canvas.width = width;
    this.canvas.height = height;
    this.raster.resize(width, height);
    this.image =
      width && height
        ? new ImageData(new Uint8ClampedArray(this.raster.pixels.buffer as ArrayBuffer), width, height)
        : null;
  }

  draw(
    clouds: Map<string, Painted>,
    view: ArrayLike<number>,
    _camera: PerspectiveCamera,
    window: Window3,
    background: Rgb,
    light: boolean,
  ): void {
    if (!this.image) return;
    this.raster.begin(abgr(background));
    for (const cloud of clouds.values()) this.raster.draw(cloud, view, window);
    if (light) this.raster.light();
    this.context.putImageData(this.image, 0, 0);
  }
}

const kVertex = `
uniform vec4 section; uniform float section_half; uniform vec2 slab; uniform vec2 ramp_range; uniform float size; uniform float use_own;
attribute float own;
varying float shade; varying float hidden;
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  float s = dot(section.xyz, world.xyz) - section.w;
  hidden = (world.z < slab.x || world.z > slab.y || abs(s) > section_half) ? 1.0 : 0.0;
  shade = use_own > 0.5 ? own : clamp((world.z - ramp_range.x) / max(ramp_range.y - ramp_range.x, 1e-6), 0.0, 1.0);
  gl_Position = projectionMatrix * viewMatrix * world;
  gl_PointSize = size;
}`;
const kFragment = `
uniform sampler2D ramp; varying float shade; varying float hidden;
void main() { if (hidden > 0.5) discard; gl_FragColor = vec4(texture2D(ramp, vec2(shade * 0.996 + 0.002, 0.5)).rgb, 1.0); }`;

export class GpuPainter implements Painter {
  readonly canvas = document.createElement("canvas");
  readonly name = "GPU";
  private renderer = new WebGLRenderer({ canvas: this.canvas, antialias: false, powerPreference: "high-performance" });
  private scene = new Scene();
  private drawn = new Map<
    string,
    { xyz: Int16Array; shades?: Uint8Array; points: Points<BufferGeometry, ShaderMaterial> }
  >();
  private textures = new Map<Uint32Array, DataTexture>();
  private ratio = 1;

  resize(width: number, height: number, ratio: number): void {
    this.ratio = ratio;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
  }

  draw(
    clouds: Map<string, Painted>,
    _view: ArrayLike<number>,
    camera: PerspectiveCamera,
    window: Window3,
    background: Rgb,
  ): void {
    for (const [name, { points }] of this.drawn) points.visible = clouds.has(name);
    for (const [name, cloud] of clouds) this.place(name, cloud, window);
    this.renderer.setClearColor((background[0] << 16) | (background[1] << 8) | background[2]);
    this.renderer.render(this.scene, camera);
  }

  private place(name: string, cloud: Painted, window: Window3): void {
    let held = this.drawn.get(name);
    if (held && held.xyz !== cloud.xyz) {
      this.scene.remove(held.points);
      held.points.geometry.dispose();
      held = undefined;
    }
    if (!held) this.drawn.set(name, (held = { xyz: cloud.xyz, points: this.make(cloud.xyz) }));
    const { points } = held;
    const T = cloud.T_world;
    const s = cloud.step_m;
    points.matrix = new Matrix4().set(
      T[0] * s,
      T[1] * s,
      T[2] * s,
      T[3],
      T[4] * s,
      T[5] * s,
      T[6] * s,
      T[7],
      T[8] * s,
      T[9] * s,
      T[10] * s,
      T[11],
      0,
      0,
      0,
      1,
    );
    points.geometry.setDrawRange(0, cloud.count);
    const u = points.material.uniforms;
    const plane = window.section;
    u.section.value.set(...(plane?.normal ?? [0, 0, 0]), plane?.offset_m ?? 0);
    u.section_half.value = plane?.half_m ?? 1e30;
    u.slab.value.set(Math.max(window.low_m, -1e30), Math.min(window.high_m, 1e30));
    u.ramp_range.value.set(window.ramp_low_m, window.ramp_high_m);
    u.size.value = cloud.size * this.ratio;
    u.use_own.value = cloud.shades ? 1 : 0;
    if (cloud.shades && held.shades !== cloud.shades)
      points.geometry.setAttribute("own", new BufferAttribute((held.shades = cloud.shades), 1, true));
    u.ramp.value = this.texture(cloud.ramp);
  }

  private make(xyz: Int16Array): Points<BufferGeometry, ShaderMaterial> {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(xyz, 3));
    const uniforms = {
      section: { value: new Vector4() },
      section_half: { value: 0 },
      slab: { value: new Vector2() },
      ramp_range: { value: new Vector2() },
      size: { value: 1 },
      use_own: { value: 0 },
      ramp: { value: null },
    };
    const points = new Points(
      geometry,
      new ShaderMaterial({ vertexShader: kVertex, fragmentShader: kFragment, uniforms }),
    );
    points.matrixAutoUpdate = false;
    points.frustumCulled = false;
    this.scene.add(points);
    return points;
  }

  private texture(ramp: Uint32Array): DataTexture {
    let texture = this.textures.get(ramp);
    if (!texture) {
      texture = new DataTexture(new Uint8Array(ramp.buffer.slice(0)), ramp.length, 1, RGBAFormat, UnsignedByteType);
      texture.needsUpdate = true;
      this.textures.set(ramp, texture);
    }
    return texture;
  }
}

/** The name of the GPU that draws WebGL here; null when there is none or only software. */
export function gpu_name(): string | null {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl) return null;
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return /SwiftShader|llvmpipe|software/i.test(name) ? null : name;
}
