// Decoder for adaptive binary arithmetic coding, the counterpart of engine/format/range_coder.h.

const CHANCE_BITS = 15, LEAST_CHANCE = 32, MOST_SEEN = 120;

/** Adaptation rate of a probability after so many decisions, times 2^16. */
const RATES = Int32Array.from({ length: MOST_SEEN + 1 }, (_, seen) => Math.floor(131072 / (2 * seen + 3)));

/** Decodes decisions from bytes. Reads zeros beyond their end. */
export class RangeDecoder {
  #bytes; #at = 0;
  #interval = new Uint32Array(2);  // code, range; an array avoids allocating 32-bit numbers
  #chances; #seen;

  /**
   * @param {Uint8Array} bytes
   * @param {number} chances number of probabilities
   */
  constructor(bytes, chances) {
    this.#chances = new Uint16Array(chances).fill(1 << (CHANCE_BITS - 1));
    this.#seen = new Uint8Array(chances);
    this.#bytes = bytes;
    for (let i = 0; i < 5; ++i) this.#interval[0] = (this.#interval[0] << 8) | this.#next();
    this.#interval[1] = 0xffffffff;
  }

  #next() {
    const at = this.#at++;
    return at < this.#bytes.length ? this.#bytes[at] : 0;
  }

  get ended() {
    return this.#at > this.#bytes.length;
  }

  /** Decodes 0 or 1 with probability i, and adapts it. */
  decide(i) {
    const interval = this.#interval, chances = this.#chances, seen = this.#seen;
    let code = interval[0], range = interval[1];
    const chance = chances[i], bound = Math.imul(range >>> CHANCE_BITS, chance) >>> 0, decision = code >= bound ? 1 : 0;
    if (decision) {
      code -= bound;
      range -= bound;
    } else {
      range = bound;
    }
    const learnt = chance + (((decision ? -chance : (1 << CHANCE_BITS) - chance) * RATES[seen[i]]) >> 16);
    chances[i] = Math.min(Math.max(learnt, LEAST_CHANCE), (1 << CHANCE_BITS) - LEAST_CHANCE);
    if (seen[i] < MOST_SEEN) ++seen[i];
    while (range < 0x1000000) {
      range = (range << 8) >>> 0;
      code = ((code << 8) | this.#next()) >>> 0;
    }
    interval[0] = code;
    interval[1] = range;
    return decision;
  }
}
