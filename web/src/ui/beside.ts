// SPDX-License-Identifier: BSD-3-Clause
/** The map beside the survey: the same view several times, by odometry alone, by the server, and what is really there. */
import type { App } from "../app";
import type { Cloud } from "../cloud";
import { abgr, bad, ramp_of } from "../colours";
import { rows_of } from "../pose";
import type { Painted } from "../raster";
import type { Pose } from "../schema";
import { Dresser, window_of } from "../scene/dress";
import { CpuPainter } from "../scene/painters";
import { SurveyDistance } from "../survey";
import type { View } from "../scene/view";
import { h } from "./dom";

interface Picture {
  name: string;
  words: string;
  offered: () => boolean;
  clouds: () => Map<string, Painted>;
}

const kWidth = 480;
const kHeight = 300;

export function beside(app: App, view: View): HTMLElement {
  const survey = app.store.get("survey");
  const odometry = app.store.get("odometry");
  if (!survey && !odometry) return h("section");
  if (survey) app.clouds.want(survey.cloud);
  const makers = new Makers(app, view);
  const pictures: Picture[] = [
    {
      name: "onboard",
      words: "by each robot's odometry alone",
      offered: () => odometry !== null,
      clouds: () => makers.placed((id) => odometry!.get(id) ?? null),
    },
    {
      name: "server",
      words: "the joint map",
      offered: () => true,
      clouds: () => makers.placed((id) => app.world.placed.get(id)?.T ?? null),
    },
    { name: "survey", words: "what is really there", offered: () => survey !== null, clouds: () => makers.survey() },
    {
      name: "distance",
      words: "the joint map, by its distance to the survey's nearest point",
      offered: () => survey !== null,
      clouds: () => makers.distance(),
    },
  ];
  const shown = pictures.filter((p) => p.offered()).map((picture) => ({ picture, painter: new CpuPainter() }));
  const figures = shown.map(({ picture, painter }) =>
    h("figure", {}, painter.canvas, h("figcaption", {}, h("b", {}, picture.name), ` ${picture.words}`)),
  );
  const element = h(
    "section",
    {},
    h("h2", {}, "The map beside the survey"),
    h(
      "p",
      { class: "lead" },
      "Every picture shows the same place at the same scale; move the big one, and these follow.",
    ),
    h("div", { class: "figures" }, figures),
    survey
      ? h(
          "p",
          { class: "row key" },
          h(
            "span",
            { class: "scale" },
            h("span", {}, "0"),
            h("span", {
              class: "gradient",
              style: {
                background: `linear-gradient(90deg,${[0, 0.25, 0.5, 0.75, 1].map((x) => `rgb(${bad(x).map(Math.round).join()})`).join()})`,
              },
            }),
            h("span", {}, `${100 * SurveyDistance.most_m} cm or more`),
          ),
          h("span", {}, "distance to the survey"),
        )
      : null,
  );
  for (const { painter } of shown) painter.resize(kWidth, kHeight);
  let waiting = false;
  const draw = (): void => {
    waiting = false;
    if (!element.isConnected || !view.eye.width) return;
    const matrix = view.eye.reshaped(kWidth / kHeight);
    for (const { picture, painter } of shown) {
      painter.draw(
        picture.clouds(),
        matrix,
        view.eye.camera,
        window_of(app.world, app.options),
        app.dark ? [14, 18, 26] : [244, 243, 239],
        false,
      );
    }
  };
  view.on_draw(() => {
    if (waiting) return;
    waiting = true;
    setTimeout(draw, 120);
  });
  setTimeout(draw, 300);
  return element;
}

class Makers {
  private dresser = new Dresser();
  private grey = ramp_of([140, 150, 165], true);
  private bad = Uint32Array.from({ length: 256 }, (_, i) => abgr(bad(i / 255)));

  constructor(
    private readonly app: App,
    private readonly view: View,
  ) {}

  placed(pose: (id: string) => Pose | null): Map<string, Painted> {
    const { app, view } = this;
    const out = this.dresser.dress(
      app.world,
      app.clouds,
      view.eye,
      {
        ...view.dressing(),
        options: { ...app.options, colour: "robot", layers: { ...app.options.layers, clouds: true } },
      },
      true,
    );
    for (const [id, painted] of out) {
      const T = pose(id);
      if (T) painted.T_world = rows_of(T);
      else out.delete(id);
      painted.size = 1;
    }
    return out;
  }

  private survey_cloud(): Cloud | null {
    const survey = this.app.store.get("survey");
    return survey ? this.app.clouds.get(survey.cloud) : null;
  }

  survey(): Map<string, Painted> {
    const cloud = this.survey_cloud();
    return cloud
      ? new Map([
          [
            "survey",
            {
              xyz: cloud.xyz,
              count: cloud.n,
              step_m: cloud.step_m,
              T_world: rows_of([0, 0, 0, 0, 0, 0, 1]),
              ramp: this.grey,
              size: 1,
            },
          ],
        ])
      : new Map();
  }

  /** Points by their distance to the survey, computed once per cloud. */
  distance(): Map<string, Painted> {
    const distances = this.view.survey_distance();
    const out = new Map<string, Painted>();
    for (const [id, placed] of this.app.world.placed) {
      const cloud = this.app.clouds.get(id);
      if (cloud && distances)
        out.set(id, {
          xyz: cloud.xyz,
          count: cloud.n,
          step_m: cloud.step_m,
          T_world: rows_of(placed.T),
          ramp: this.bad,
          size: 1,
          shades: distances.shades(id, cloud, placed.target),
        });
    }
    return out;
  }
}
