// SPDX-License-Identifier: BSD-3-Clause
/** Who looks at the page. Where the server wants a credential, it is read and used here; its seed never leaves the page. */
import type { App } from "../app";
import { api } from "../api";
import { read_credential, sign } from "../credential";
import { memory } from "../options";
import { LiveSource } from "../sources/live";
import { attempt, button, h, notice } from "./dom";
import type { Child } from "./dom";

export function person(app: App): Child {
  const { me } = app;
  if (app.is_locked())
    return h(
      "label",
      { class: "button primary", title: "Choose the credential file that `tutti pki` has made for you" },
      "Log in",
      credential_input(app),
    );
  if (me.login)
    return h(
      "span",
      { class: "person" },
      h("b", {}, me.name),
      ` ${me.role}`,
      button("Log out", () => void attempt(() => log_out(app)), { class: "plain" }),
    );
  if (!me.may_decide) return null;
  return button(app.by ? `You: ${app.by}` : "Your name?", () => void name_of(app), {
    class: "plain",
    title: "Decisions carry this name",
  });
}

function credential_input(app: App): HTMLElement {
  return h("input", {
    type: "file",
    class: "hidden",
    "aria-label": "Credential file",
    on: {
      change: ((e: Event) => {
        const file = (e.target as HTMLInputElement).files?.[0];
        if (file) void attempt(() => log_in(app, file));
      }) as () => void,
    },
  });
}

async function log_in(app: App, file: Blob): Promise<void> {
  const credential = read_credential(await file.text());
  await app.ask_me(); // the nonce may be old
  await api.login(app.me.nonce, credential.key, await sign(credential.seed, app.me.nonce));
  credential.seed.fill(0);
  await app.ask_me();
  if (app.source instanceof LiveSource) app.source.restart();
  notice(`Logged in as ${app.me.name}, ${app.me.role ?? "nobody"}.`);
}

async function log_out(app: App): Promise<void> {
  await api.logout();
  await app.ask_me();
  if (app.source instanceof LiveSource) app.source.restart();
}

/** Asks for a name where nobody logs in; "" when none is given. */
export function name_of(app: App): Promise<string> {
  return new Promise((resolve) => {
    const input = h("input", { type: "text", maxlength: "64", placeholder: "Name", value: app.by });
    const dialog = h(
      "dialog",
      { class: "ask" },
      h(
        "form",
        { method: "dialog" },
        h("h2", {}, "Your name"),
        h("p", {}, "Every decision carries it."),
        input,
        h(
          "div",
          { class: "row" },
          h("button", { value: "ok", class: "primary" }, "Use it"),
          h("button", { value: "no", formnovalidate: true }, "Cancel"),
        ),
      ),
    );
    dialog.addEventListener("close", () => {
      if (dialog.returnValue === "ok" && input.value.trim()) {
        app.by = input.value.trim();
        memory.write("by", app.by);
        app.say("me");
      }
      dialog.remove();
      resolve(app.by);
    });
    document.body.append(dialog);
    dialog.showModal();
  });
}

/** The name that a decision carries; asks for it when there is none. "" : nobody wants to give one. */
export const who = async (app: App): Promise<string> => (app.me.login ? app.me.name : app.by || name_of(app));
