// Questions to the server that served this page.

import type { Fault, MapDocument, Opened, Plan, Suggestion } from "./types";

const token =
  document.querySelector<HTMLMetaElement>('meta[name="toponav-token"]')?.content ?? "";

export class Refused extends Error {
  constructor(
    readonly status: number,
    message: string,
    readonly remedy = "",
  ) {
    super(message);
  }
}

async function ask(method: string, path: string, body?: unknown): Promise<Response> {
  let answer: Response;
  try {
    answer = await fetch(`/api/${path}`, {
      method,
      headers: { "X-Toponav-Token": token, "Content-Type": "application/json" },
      body: body === undefined ? null : JSON.stringify(body),
    });
  } catch {
    throw new Refused(0, "The editor's server has ended", "run toponav map edit again");
  }
  if (answer.ok) return answer;
  const text = await answer.text();
  let said: { error?: { where: string; rule: string; remedy: string } } = {};
  try {
    said = JSON.parse(text) as typeof said;
  } catch {
    throw new Refused(answer.status, text.trim().replace(/^toponav: /, ""));
  }
  const { error } = said;
  throw new Refused(answer.status, error ? `${error.where}: ${error.rule}` : text, error?.remedy);
}

const asked = async <Answer>(method: string, path: string, body?: unknown): Promise<Answer> =>
  (await (await ask(method, path, body)).json()) as Answer;

export const api = {
  open: () => asked<Opened>("GET", "map"),
  version: async () => (await asked<{ version: string }>("GET", "version")).version,
  /** The version that was written, or null when somebody else wrote the file. */
  save: async (map: MapDocument, base: string, overwrite = false): Promise<string | null> => {
    try {
      return (await asked<{ version: string }>("PUT", "map", { map, base, overwrite })).version;
    } catch (error) {
      if (error instanceof Refused && error.status === 409) return null;
      throw error;
    }
  },
  saveCopy: async (map: MapDocument) => (await asked<{ file: string }>("POST", "copy", { map })).file,
  faults: async (map: MapDocument) =>
    (await asked<{ faults: Fault[] }>("POST", "faults", { map })).faults,
  suggestions: async (map: MapDocument, edges?: string[]) =>
    (await asked<{ suggestions: Suggestion[] }>("POST", "suggestions", { map, edges: edges ?? null }))
      .suggestions,
  repair: (map: MapDocument) =>
    asked<{ map: MapDocument; fixed: number }>("POST", "repair", { map }),
  plans: async (map: MapDocument, start: string, goal: string) =>
    (await asked<{ plans: Plan[] }>("POST", "plans", { map, start, goal })).plans,
  construct: async (map: MapDocument) =>
    (await asked<{ map: MapDocument }>("POST", "construct", { map })).map,
  floor: async (theme: string) => (await ask("GET", `floor/${theme}`)).blob(),
};
