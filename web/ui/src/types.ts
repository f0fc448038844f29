// The objects that cross the wire, in the form of docs/api.md, as far as the page reads them.

export type JobState = 'uploading' | 'queued' | 'held' | 'printing' | 'paused' | 'done' | 'cancelled' | 'failed';

export interface JobFacts {
  /** The printer's own estimate. */
  estimated_s: number | null;
  /** What that time goes into: by the slicer's feature, travel, heating and so on. */
  activities_s?: Record<string, number>;
  /** The slicer's claim. */
  slicer_s?: number | null;
  filament_mm: number | null;
  layers: number | null;
  lines?: number | null;
  min_mm?: number[];
  max_mm?: number[];
  hot_end_c: number | null;
  bed_c: number | null;
  slicer: string | null;
  thumbnail: boolean;
  warnings: { line: number; message: string }[];
}

export interface Progress {
  bytes: number;
  /** The share of the time, 0 to 1. */
  fraction: number;
  elapsed_s: number;
  /** Null: nobody knows yet. */
  remaining_s: number | null;
}

export interface Job {
  id: number;
  name: string;
  size: number;
  state: JobState;
  hold: boolean;
  copies: number;
  copies_done: number;
  position: number | null;
  started: string | null;
  ended: string | null;
  error: string | null;
  facts: JobFacts;
  progress: Progress;
  /** Where a failed or cancelled one stopped; null: not known, or it did not stop. */
  stopped_line: number | null;
  stopped_layer: number | null;
  /** Likewise: so many of its bytes were executed. */
  stopped_byte: number | null;
  /** What its last copy took of the printer's time, pauses excluded; null: not known. */
  printed_s: number | null;
}

export interface HeaterStatus {
  c: number;
  /** False: the sensor gives no reading now, and `c` is the last one. */
  reading: boolean;
  target_c: number;
  duty: number;
}

export interface Timing {
  late_steps: number;
  shift_ns: number;
  starved: number;
  pulses: number[];
  lateness_ns: { p50: number; p99: number; p9999: number; max: number; count: number; buckets: [number, number][] };
}

export type MachineState =
  | 'disconnected' | 'starting' | 'idle' | 'printing' | 'pausing' | 'paused' | 'cancelling' | 'faulted';

/** What the machine does before a print moves on, or instead. */
export type Activity = 'homing' | 'probing' | 'heating_hot_end' | 'heating_bed' | 'returning';

/**
 * What a printer may lack. live: the stream, so it is asked instead; hand: jog, heat and typed
 * lines; layers: pictures of them; guarantee: its report; queue: order, copies and a hold;
 * invitation: links that sign in another browser.
 */
export type Part = 'live' | 'hand' | 'layers' | 'guarantee' | 'queue' | 'invitation';

export interface Status {
  /** Absent: it has all. */
  lacks?: Part[];
  connected: boolean;
  session: string | null;
  state: MachineState;
  /** Null: it prints, or rests. Absent: the printer does not say. */
  activity?: Activity | null;
  job: number | null;
  fault: string | null;
  message: string;
  position_mm: { x: number; y: number; z: number; e: number };
  homed: boolean[];
  hot_end: HeaterStatus;
  bed: HeaterStatus;
  fan: number;
  layer: number;
  line: number;
  bytes_executed: number;
  print_time_s: number;
  /** The progress of `job`. */
  progress: Progress | null;
  /** Until each waiting job of the first page is done, by id; without those that nobody knows. */
  ready_in_s: Record<number, number>;
  /** Seconds until the heaters go off because nobody uses them; null: not counting. */
  idle_off_in_s: number | null;
  /** They went off for that reason; until a target is set again. */
  idle_timed_out: boolean;
  /** From the machine file; 0: heaters are never switched off by themselves. */
  idle_timeout_s: number;
  /** Paused, and the head has moved away. */
  parked: boolean;
  may_jog: boolean;
  /** Seconds of the printer in one of the wall's; other than 1 for a simulated printer. */
  time_factor: number;
  timing: Timing;
}

export interface History {
  t_s: number[];
  hot_end_c: (number | null)[];
  hot_end_target_c: (number | null)[];
  bed_c: (number | null)[];
  bed_target_c: (number | null)[];
}

/** Why the queue does not go on by itself, if it does not. */
export interface QueueGate {
  held: boolean;
  reason: string | null;
  bed_occupied: boolean;
  /** Each job waits until a person has said that the bed is clear. */
  confirm_bed: boolean;
  /** False: without power it is gone. Absent: it is kept. */
  durable?: boolean;
  /** So many jobs may wait; absent: as many as you like. */
  places?: number;
}

/** Jobs of each state, all of them, however many a page lists. */
export interface JobCounts {
  queued: number;
  held: number;
  printing: number;
  done: number;
  cancelled: number;
  failed: number;
  total: number;
}

/** GET /api/v1/jobs, and the live stream's first page. */
export interface JobPage {
  jobs: Job[];
  next_before: number | null;
  counts: JobCounts;
  queue: QueueGate;
}

export interface Axis {
  min_mm: number;
  max_mm: number;
}

/** GET /api/v1/config, as far as the page needs it. */
export interface MachineConfig {
  name: string;
  axes: { x: Axis; y: Axis; z: Axis };
  hot_end: { max_c: number; min_extrude_c: number };
  bed: { present: boolean; max_c: number };
}

/**
 * GET /api/v1/jobs/ID/inspection: the part that the virtual machine built, compared with the one
 * asked for.
 */
export interface Inspection {
  matches: boolean;
  differences: string[];
  layer_count: number;
  lost_steps: Record<string, number>;
  path_deviation_mm_max: Record<string, number>;
  filament_mm: { asked: number; built: number };
}

export interface LayerIndex {
  index: number;
  layer: number;
  z_mm: number;
  segments: number;
  bytes: number;
  first_byte: number;
  /** Estimated, in the layer's first record. */
  time_s?: number;
}

/** A process tree that is held to a budget. */
export interface TreeGuarantee {
  name: string; core: number; budget_us: number; period_us: number;
  admitted: boolean; response_us: number | null; enforced: boolean; shortfall: string;
}

/** The print service's own VCPU; `used_share` is of a core, over the last seconds. */
export interface ServiceVcpu extends TreeGuarantee {
  enforced_by: string | null; used_share: number; periods: number; throttled: number;
}

/** A loop, or a bottom half's I/O VCPU: what it is promised, and what became of that so far. */
export interface LoopGuarantee {
  id: number; core: number; budget_us: number; period_us: number;
  priority_enforced: boolean; budget_enforced: boolean; core_owned: boolean; shortfall: string;
  /** CPU time in the time since the loops began; null: nobody watches it. */
  cpu_used_us: number | null; watched_us: number | null;
  held_from_outside: number; escape: string;
  /** Null: it has no periods of its own. */
  releases: number | null; overruns: number | null; missed: number | null; worst_late_us: number | null;
}

/** A chain of loops from an input to an output: what bounds it, and the worst that was seen. */
export interface ChainGuarantee {
  name: string;
  /** "thermistors > loop 3 > heaters" */
  way: string;
  /** From a change of the input to the output that answers it; the sketch's own limit, or null. */
  reaction_bound_us: number; reaction_limit_us: number | null;
  /** How old the data is on which an output rests; null: it has no age. */
  age_bound_us: number | null; age_limit_us: number | null;
  reactions: number;
  /** Null: nothing came through it yet. */
  worst_reaction_us: number | null; worst_age_us: number | null;
  /** Nobody knows when its event came: it is seen from its first loop on. */
  from_first_loop: boolean;
}

/** As of the last second. */
export interface Guarantee {
  board: string;
  /** In virtual time: nothing is late there. */
  simulated?: boolean;
  loops: LoopGuarantee[];
  cores: {
    core: number; interrupts_per_second: number | null; worst_gap_us: number | null; counted_per_second: number | null;
    note: string;
  }[];
  trees?: TreeGuarantee[];
  chains?: ChainGuarantee[];
  service?: ServiceVcpu | null;
}

export type LiveMessage =
  | { type: 'status'; status: Status }
  | ({ type: 'jobs' } & JobPage)
  | { type: 'reply'; kind: 'text' | 'warning' | 'error'; text: string }
  | { type: 'upload'; name: string; received: number; size: number }
  | { type: 'alive'; time: string }
  | ({ type: 'history' } & History);
