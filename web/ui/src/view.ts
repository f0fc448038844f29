// The part in 3D: extrusions laid down as far as the job has been executed, and the nozzle above
// them.
//
// One object a packed record, its segments in the order of the job; drawing up to a byte is a count
// of segments, found by bisection. Records of the same job are only ever added, and nothing is
// drawn while nothing changes.
import {
  BufferAttribute, BufferGeometry, Color, ConeGeometry, CylinderGeometry, DirectionalLight, Group, HemisphereLight, InstancedBufferGeometry,
  LineBasicMaterial, LineSegments, Mesh, MeshStandardMaterial, PerspectiveCamera, Scene, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { beadGeometry, beadMaterial, BEADS_MAX, thinGeometry, thinMaterial } from './bead';
import { FEATURE_COLOURS, segmentsDone, type LayerRecord } from './layers';
import type { MachineConfig } from './types';

interface Drawn {
  record: LayerRecord;
  object: Mesh | LineSegments;
}

export type Direction = 'corner' | 'top' | 'front';
const DIRECTIONS: Record<Direction, Vector3> = {
  corner: new Vector3(0.5, -1, 0.66).normalize(), top: new Vector3(0, -0.001, 1).normalize(), front: new Vector3(0, -1, 0.06).normalize(),
};

/** Both ends of bed lines every 10 mm, and of its outline. */
function bedLines(low: Vector3, high: Vector3): { grid: number[]; outline: number[] } {
  const grid: number[] = [];
  for (let x = low.x + 10; x < high.x - 1e-6; x += 10) grid.push(x, low.y, 0, x, high.y, 0);
  for (let y = low.y + 10; y < high.y - 1e-6; y += 10) grid.push(low.x, y, 0, high.x, y, 0);
  const corners = [[low.x, low.y], [high.x, low.y], [high.x, high.y], [low.x, high.y]];
  const outline = corners.flatMap(([x, y], i) => [x, y, 0, ...corners[(i + 1) % 4], 0]);
  return { grid, outline };
}

function lines(positions: number[], colour: number): LineSegments {
  const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(new Float32Array(positions), 3));
  return new LineSegments(geometry, new LineBasicMaterial({ color: new Color(colour) }));
}

/** Tip at the origin, pointing down. */
function nozzle(): Group {
  const brass = new MeshStandardMaterial({ color: 0xd9a441, roughness: 0.35, metalness: 0.55 });
  const steel = new MeshStandardMaterial({ color: 0x8fa3b5, roughness: 0.5, metalness: 0.3, transparent: true, opacity: 0.8 });
  const tip = new Mesh(new ConeGeometry(2.2, 4.5, 28), brass);
  const block = new Mesh(new CylinderGeometry(4, 4, 6, 28), steel);
  tip.rotation.x = -Math.PI / 2;
  tip.position.z = 2.25;
  block.rotation.x = Math.PI / 2;
  block.position.z = 7.4;
  return new Group().add(tip, block);
}

export class PartView {
  private renderer: WebGLRenderer;
  private scene = new Scene();
  private camera = new PerspectiveCamera(34, 1, 1, 5000);
  private controls: OrbitControls;
  private beads = beadMaterial();
  private thin = thinMaterial();
  private drawn: Drawn[] = [];
  private tool = nozzle();
  private bed = new Group();
  private observer: ResizeObserver;
  private scheme = matchMedia('(prefers-color-scheme: dark)');
  private frame = 0;
  private low: Vector3;
  private high: Vector3;

  constructor(private canvas: HTMLCanvasElement, config: MachineConfig | null) {
    const { x, y } = config?.axes ?? { x: { min_mm: 0, max_mm: 150 }, y: { min_mm: 0, max_mm: 150 } };
    this.low = new Vector3(x.min_mm, y.min_mm, 0);
    this.high = new Vector3(x.max_mm, y.max_mm, 0);
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = Math.PI * 0.53;
    this.controls.addEventListener('change', this.draw);
    // A finger that goes up or down scrolls the page; sideways, it turns the part.
    canvas.style.touchAction = 'pan-y';
    const sun = new DirectionalLight(0xffffff, 1.6);
    sun.position.set(1, -2, 3);
    this.tool.visible = false;
    this.scene.add(new HemisphereLight(0xffffff, 0x556677, 2.2), sun, this.bed, this.tool);
    this.scheme.addEventListener('change', this.restyle);
    this.restyle();
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(canvas.parentElement!);
    this.resize();
    this.frameOn(null, 'corner');
  }

  dispose(): void {
    cancelAnimationFrame(this.frame);
    this.observer.disconnect();
    this.scheme.removeEventListener('change', this.restyle);
    this.clear();
    for (const root of [this.bed, this.tool]) this.free(root);
    this.beads.dispose();
    this.thin.dispose();
    this.controls.dispose();
    cancelAnimationFrame(this.frame);
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  clear(): void {
    for (const { object } of this.drawn) {
      this.scene.remove(object);
      object.geometry.dispose();
    }
    this.drawn = [];
    this.draw();
  }

  /** `beads`: solid, else as lines; the same for all records of one job. */
  add(record: LayerRecord, solid: boolean): void {
    const tints = new Uint8Array(record.segments * 4);
    for (let i = 0; i < record.segments; i++) {
      const [r, g, b] = FEATURE_COLOURS[record.features[i]] ?? FEATURE_COLOURS[0];
      // Every other layer a little darker, so that layers can be told apart from the side.
      const shade = (record.layer & 1 ? 0.88 : 1) * 255;
      tints.set([r * shade, g * shade, b * shade, 255], i * 4);
    }
    const object = solid ? new Mesh(beadGeometry(record, tints), this.beads) : new LineSegments(thinGeometry(record, tints), this.thin);
    object.frustumCulled = false;
    this.scene.add(object);
    this.drawn.push({ record, object });
    this.draw();
  }

  /** Features that occur, in the order of their numbers. */
  features(): number[] {
    const seen = new Set<number>();
    for (const { record } of this.drawn) for (let i = 0; i < record.segments; i++) seen.add(record.features[i]);
    return [...seen].sort((a, b) => a - b);
  }

  /** Draws what is laid down after `executed` bytes, and no layer from `top` on (null: all). */
  show(executed: number, top: number | null): void {
    for (const { record, object } of this.drawn) {
      const count = executed === Infinity ? record.segments : segmentsDone(record, executed);
      object.visible = count > 0 && (top === null || record.layer < top);
      const geometry = object.geometry;
      if (geometry instanceof InstancedBufferGeometry) geometry.instanceCount = count;
      else geometry.setDrawRange(0, 2 * count);
    }
    this.draw();
  }

  /** The nozzle's tip; null: not shown. */
  head(position: { x: number; y: number; z: number } | null): void {
    this.tool.visible = position !== null;
    if (position) this.tool.position.set(position.x, position.y, position.z);
    this.draw();
  }

  /** Looks at a box, or at the whole bed. */
  frameOn(box: { min: number[]; max: number[] } | null, from: Direction): void {
    const low = box ? new Vector3(...box.min) : this.low.clone();
    const high = box ? new Vector3(...box.max) : this.high.clone();
    const radius = Math.max(18, high.distanceTo(low) / 2);
    const vertical = (this.camera.fov * Math.PI) / 360;
    const half = Math.min(vertical, Math.atan(Math.tan(vertical) * this.camera.aspect));
    const centre = low.add(high).multiplyScalar(0.5);
    this.controls.target.copy(centre);
    this.camera.position.copy(centre).addScaledVector(DIRECTIONS[from], (radius / Math.sin(half)) * (box ? 1.08 : this.camera.aspect > 1.2 ? 0.82 : 1));
    this.controls.update();
    this.draw();
  }

  private free(root: Group): void {
    root.traverse((each) => {
      if (!(each instanceof Mesh || each instanceof LineSegments)) return;
      each.geometry.dispose();
      (each.material as LineBasicMaterial).dispose();
    });
    root.clear();
  }

  private restyle = (): void => {
    this.free(this.bed);
    const { grid, outline } = bedLines(this.low, this.high);
    const dark = this.scheme.matches;
    this.bed.add(lines(grid, dark ? 0x2b3947 : 0xd0d8e0), lines(outline, dark ? 0x566879 : 0x97a5b3));
    this.draw();
  };

  private resize(): void {
    const box = this.canvas.parentElement!.getBoundingClientRect();
    if (box.width < 2 || box.height < 2) return;
    this.renderer.setSize(box.width, box.height, false);
    this.camera.aspect = box.width / box.height;
    this.camera.updateProjectionMatrix();
    // At once: a canvas that was resized is empty, and would flash until the next frame.
    this.renderer.render(this.scene, this.camera);
  }

  private draw = (): void => {
    this.frame ||= requestAnimationFrame(() => {
      this.frame = 0;
      this.renderer.render(this.scene, this.camera);
    });
  };
}

export const solidFor = (segments: number): boolean => segments <= BEADS_MAX;
