// SPDX-License-Identifier: BSD-3-Clause
/** Reads report.json and timing.json (docs/report.md): keys that are missing read as null, in reports of other versions too. */
import type { Report } from "../schema";

export class Node {
  constructor(private readonly value: unknown) {}

  at(key: string | number): Node {
    const v = this.value;
    if (typeof v !== "object" || v === null || !Object.hasOwn(v, key)) return new Node(null);
    return new Node((v as Record<string | number, unknown>)[key]);
  }
  /** A number by a path such as "map_error.onboard.mean_m". */
  n(path: string): number | null {
    const v = this.to(path).value;
    return typeof v === "number" && Number.isFinite(v) ? v : null;
  }
  s(path: string): string {
    const v = this.to(path).value;
    return typeof v === "string" ? v : typeof v === "number" || typeof v === "boolean" ? String(v) : "";
  }
  yes(path: string): boolean {
    return this.to(path).value === true;
  }
  list(path: string): Node[] {
    const v = this.to(path).value;
    return Array.isArray(v) ? v.map((x) => new Node(x)) : [];
  }
  texts(path: string): string[] {
    return this.list(path)
      .map((x) => x.s(""))
      .filter((x) => x !== "");
  }
  keys(path: string): string[] {
    const v = this.to(path).value;
    return typeof v === "object" && v !== null && !Array.isArray(v) ? Object.keys(v) : [];
  }
  has(path: string): boolean {
    return this.to(path).value !== null;
  }
  to(path: string): Node {
    return path === "" ? this : path.split(".").reduce<Node>((node, key) => node.at(key), this);
  }
}

export const reading = (report: Report | null): Node => new Node(report);

/** The part on the policy that the robot followed. */
export const followed = (report: Node, robot: Node): Node => robot.at("policies").at(report.s("default_policy"));
