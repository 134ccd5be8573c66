// SPDX-License-Identifier: BSD-3-Clause
/** How much the page keeps, and when it calls something old: all bounds in one place. */
export const LIMITS = {
  /** Messages kept per key in a running mission; older ones are thinned. A report keeps everything. */
  history: {
    mission: 1,
    status: 240,
    alerts: 120,
    submap: 2,
    poses: 240,
    closure: 8,
    disagreement: 12,
    trajectory: 1,
    errors: 1,
    survey: 1,
    report: 1,
    timing: 1,
    settings: 1,
    compare: 1,
    odometry: 1,
    mark: 8,
    held: 1,
    places: 40,
    radio: 40,
    acknowledged: 8,
    history: 1,
  },
  /** Most keys of one kind; beyond, the oldest goes. */
  keys: 20_000,
  /** Points kept by the page in all clouds together; beyond, clouds are thinned to a prefix. */
  points: 4_000_000,
  /** Clouds fetched at once. */
  fetches: 6,
  /** Rows that a list shows before it asks for a filter. */
  rows: 200,
  /** So many alerts of one cause are one line. */
  folds: 3,
  /** Robots that a line names; beyond, it has their number. */
  names: 3,
  /** Robots beyond which the list is dense and has a search. */
  dense_robots: 12,
  /** A picture narrower than this has its legend folded. */
  narrow_px: 520,
  /** A mission of which nothing is known for so long at its beginning, s, says so. */
  unknown_s: 30,
  /** A picture that moves has fewer points when it takes longer, but never fewer than these. */
  moving_points: 100_000,
} as const;

export const TIMES = {
  /** The server sends a sign of life every second. */
  server_silent_s: 3,
  reconnect_ms: 400,
  /** Between two looks whether this browser is logged in; its own log-in is followed at once. */
  locked_ms: 3_000,
  /** Over which the drain of a backlog is measured. */
  drain_window_s: 60,
  /** How long a correction stays in sight. */
  ghost_s: 20,
  /** Corrections below this are not shown. */
  ghost_m: 0.05,
  animation_ms: 1200,
  /** Between pictures while clouds arrive. */
  clouds_ms: 250,
  /** Until a panel has drawn what was just chosen. */
  seen_ms: 80,
  /** Between pictures that move: 30 a second. */
  moving_ms: 33,
  answer_ms: 20_000,
  /** The past of a long mission has some megabytes. */
  history_ms: 120_000,
  /** The map is made once more to show what a closure by hand would change. */
  change_ms: 300_000,
  /** The server forgets who inspects what after three times this. */
  hold_ms: 10_000,
} as const;

/** A status is old when it is older than what makes a robot silent by this factor; a robot that is silent as much longer is lost. */
export const OLD_STATUS = 1.4;
export const LOST_ROBOT = 6;
/** A silent robot is somewhere in a circle: the speed it had, times its silence, at most this. */
export const REACH_M = 150;
/** A robot that never moved may start to. */
export const SLOWEST_MPS = 0.2;
