/** Smooth edges: one sample a pixel; four samples of visibility; 2 x 2 shaded samples. */
export type AntiAliasing = "none" | "msaa" | "ssaa";

/**
 * A soup of triangles in a page: `<tri-soup src="model.glb" poster="poster.png" camera="3" autorotate></tri-soup>`.
 * Its size is that of any block; without a height it is 16 to 9. Drag, wheel, touch and keys move the camera as in
 * soup-view. Shadow parts for styles: canvas, poster, progress, message.
 */
export class TriSoup extends HTMLElement {
  /** Address of a model.glb, or "#id" of an element whose text is one as base64. */
  src: string;
  /** Address of a picture to show until the first one has been drawn. */
  poster: string;
  /** Number (from 0, test views first) or name of one of the model's cameras. */
  get camera(): string;
  set camera(value: string | number);
  /** "msaa" unless something else is given. */
  aa: AntiAliasing;
  /** Turns until somebody moves it, unless the reader prefers less motion. */
  autorotate: boolean;
  /** Names of the model's cameras, test views first; empty until it is loaded. */
  readonly cameras: string[];
  /** Whether a picture of `src` has been drawn. */
  readonly loaded: boolean;

  addEventListener<K extends keyof TriSoupEventMap>(type: K,
    listener: (this: TriSoup, event: TriSoupEventMap[K]) => void, options?: boolean | AddEventListenerOptions): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject,
    options?: boolean | AddEventListenerOptions): void;
}

export interface TriSoupEventMap extends Omit<HTMLElementEventMap, "load" | "progress" | "error"> {
  /** The first picture has been drawn. */
  load: Event;
  /** Part of the model has arrived. */
  progress: ProgressEvent;
  /** It cannot be shown; `message` says why and what helps, and the element shows it. */
  error: ErrorEvent;
  /** The graphics device was lost; the last picture stays, with a message. */
  contextlost: Event;
  /** It came back, and so does the picture. */
  contextrestored: Event;
}

declare global {
  interface HTMLElementTagNameMap {
    "tri-soup": TriSoup;
  }
}
