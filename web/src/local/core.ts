/** The native core as WebAssembly, cpp/wasm/playground.cpp: typed calls, and arrays in its memory. */

/** Addresses in the module's memory. */
export type Address = number;

interface Exports {
  readonly memory: WebAssembly.Memory;
  _initialize(): void;
  allocate(bytes: number): Address;
  release(memory: Address): void;
  number_names(): Address;
  make_run(numbers: Address, arrays: Address): Address;
  place(run: Address, rules: Address, blocks: number, key: bigint, start: Address): number;
  make_world(
    run: Address,
    rules: Address,
    blocks: number,
    start: Address,
    key: bigint,
    flowStart: number,
    faces: Address,
  ): Address;
  end_world(world: Address): void;
  advance(world: Address, steps: number): void;
  step_of(world: Address): number;
  status_of(world: Address): number;
  blocks_of(world: Address): number;
  read(world: Address): Address;
  set_forces(world: Address, dragCoefficient: number, forceStd: number, flowScale: number): void;
  set_rules(world: Address, rules: Address): void;
  set_faces(world: Address, faces: Address): void;
  set_pull(world: Address, pull: Address): void;
  set_blocks(world: Address, blocks: number): number;
  part(world: Address): void;
  make_faces(
    kinds: number,
    types: number,
    count: Address,
    type: Address,
    pole: Address,
    latches: Address,
    becomes: Address,
  ): Address;
  make_pull(
    reach: number,
    lever: number,
    likePolesRepel: number,
    every: number,
    nearFading: number,
    nearEnd: number,
    nearReach: number,
  ): Address;
  set_radial(pull: Address, what: number, cells: Address, count: number, first: number): void;
  set_oriented(
    pull: Address,
    coefficient: Address,
    distances: number,
    angles: number,
    first: number,
    perStep: number,
    low: number,
    high: number,
  ): void;
  set_multipoles(pull: Address, coefficient: Address, softening: number, fading: number, end: number): void;
  form_steps(x: Address, y: Address, count: number, length: Address, angle: Address): number;
  make_reference(x: Address, y: Address, count: number): Address;
  ks_distance(reference: Address, x: Address, y: Address, count: number): number;
  permuted_distance(
    x: Address,
    y: Address,
    first: number,
    second: number,
    blockOf: Address,
    blocks: number,
    labels: Address,
  ): number;
}

/** Returns the bytes of deflated base64. */
export async function inflated(data: string): Promise<ArrayBuffer> {
  const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

export async function doubles(data: string): Promise<Float64Array> {
  return new Float64Array(await inflated(data));
}

export class Core {
  private constructor(readonly call: Exports) {}

  static async of(wasm: ArrayBuffer): Promise<Core> {
    // The C library writes what it has to say before it stops: nobody reads it.
    const silent = { fd_close: () => 0, fd_seek: () => 0, fd_write: () => 0 };
    const made = await WebAssembly.instantiate(wasm, { wasi_snapshot_preview1: silent });
    const call = made.instance.exports as unknown as Exports;
    call._initialize();
    return new Core(call);
  }

  /** Returns the address of a copy of some numbers, to be released by the caller. */
  put(values: ArrayLike<number>, kind: "double" | "int" | "byte" = "double"): Address {
    const Kind = { double: Float64Array, int: Int32Array, byte: Uint8Array }[kind];
    const address = this.call.allocate(Math.max(values.length, 1) * Kind.BYTES_PER_ELEMENT);
    new Kind(this.call.memory.buffer, address, values.length).set(values);
    return address;
  }

  /** Returns numbers at an address; they hold until the memory grows. */
  doubles(address: Address, count: number): Float64Array {
    return new Float64Array(this.call.memory.buffer, address, count);
  }

  ints(address: Address, count: number): Int32Array {
    return new Int32Array(this.call.memory.buffer, address, count);
  }

  words(address: Address): string {
    const bytes = new Uint8Array(this.call.memory.buffer, address);
    return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
  }

  /** Calls with the addresses of arrays, which are released after it. */
  with<T>(arrays: readonly ArrayLike<number>[], use: (...addresses: Address[]) => T): T {
    const addresses = arrays.map((values) => this.put(values));
    const result = use(...addresses);
    for (const address of addresses) this.call.release(address);
    return result;
  }
}

const MASK = (value: bigint): bigint => BigInt.asUintN(64, value);

function mixed(value: bigint): bigint {
  let bits = MASK(value + 0x9e3779b97f4a7c15n);
  bits = MASK((bits ^ (bits >> 30n)) * 0xbf58476d1ce4e5b9n);
  bits = MASK((bits ^ (bits >> 27n)) * 0x94d049bb133111ebn);
  return bits ^ (bits >> 31n);
}

/** Returns the key of a world's random numbers, as `world_keys` in src/driftwalk/core/random_streams.py. */
export function worldKey(seed: number, trial: bigint, replicate: number): bigint {
  return mixed(mixed(mixed(BigInt(seed)) ^ trial) ^ BigInt(replicate));
}
