// A board in simavr: its serial port is a pseudo-terminal, its pins are written down by cycle, and a pipe moves the rest.
//
//   simavr PROGRAM LINE EDGES SPEED    LINE is an open file; commands come on standard input, a letter each
//
// o and c open and close the interlock, r resets, j pulls the jumper off pin 8, n makes noise at pin 8 3 ms after each
// trigger, t writes down the time, q ends. EDGES gets lines "cycle pin level"; SPEED is how often faster than real time it may run, 0 for as fast as
// it can. Declared here is the little of libsimavr that is used; the program needs Debian's package simavr alone.
//
// The pins of Timer1 are worked out here, from what the program writes into its registers: when an OCR is written while
// the timer counts, simavr 1.6 drives a pin in a mode without PWM as at an overflow with PWM, and it knows no FOC.
#include <dlfcn.h>
#include <fcntl.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

typedef struct avr_t avr_t;
typedef struct avr_irq_t avr_irq_t;
typedef uint64_t cycles_t;
typedef cycles_t (*timer_t_)(avr_t *, cycles_t, void *);
typedef void (*notify_t)(avr_irq_t *, uint32_t, void *);
typedef struct { char mcu[64]; uint32_t frequency; char rest[1 << 16]; } firmware_t;

static avr_t *(*avr_make_mcu_by_name)(const char *);
static int (*avr_init)(avr_t *), (*avr_run)(avr_t *), (*avr_ioctl)(avr_t *, uint32_t, void *);
static int (*elf_read_firmware)(const char *, firmware_t *);
static void (*avr_load_firmware)(avr_t *, firmware_t *), (*avr_reset)(avr_t *);
static avr_irq_t *(*avr_io_getirq)(avr_t *, uint32_t, int);
static void (*avr_irq_register_notify)(avr_irq_t *, notify_t, void *), (*avr_raise_irq)(avr_irq_t *, uint32_t);
static void (*avr_cycle_timer_register)(avr_t *, cycles_t, timer_t_, void *);
static cycles_t (*avr_cycle_timer_status)(avr_t *, timer_t_, void *);
static avr_irq_t *(*avr_iomem_getirq)(avr_t *, uint16_t, const char *, int);

#define CODE(a, b, c, d) ((uint32_t)(a) << 24 | (b) << 16 | (c) << 8 | (d))
enum { HZ = 16000000, BYTE = 1389, BATCH = 400, AHEAD = HZ / 10000, START = HZ / 500 };  // a byte at 115,200 baud, in cycles

static avr_t *avr;
static avr_irq_t *uart, *heard, *interlock;
static FILE *edges;
static int line, jumper = 1, noise = 0, levels[8];
static cycles_t base = 0, far = (cycles_t)1 << 60, next_byte = START, latest = 0;

// Timer1 as the program set it: compare units A and B, at pins 1 and 2 of port B.
enum { PORTB = 0x25, TCCR1A = 0x80, TCCR1B, TCCR1C, OCR1AL = 0x88, OCR1AH, OCR1BL, OCR1BH };
static uint8_t registers[256];
static int remembered[2];
static cycles_t started = 0, matches[2];  // 0: not running, or no match to come

static void load(void *library, const char *name, void *into) {
  void *found = dlsym(library, name);
  if (!found) { fprintf(stderr, "%s\n", dlerror()); exit(2); }
  memcpy(into, &found, sizeof found);
}

static cycles_t never(avr_t *a, cycles_t when, void *p) { (void)a, (void)when, (void)p; return 0; }

// Cycles since the beginning, from those that are left until a timer that never comes.
static cycles_t now(void) {
  cycles_t left = avr_cycle_timer_status(avr, never, NULL);
  if (left) latest = base + far + 1 - left;  // else simavr's watchdog has just reset the board
  return latest;
}

static void note(cycles_t when, const char *pin, int level) {
  fprintf(edges, "%llu %s %d\n", (unsigned long long)when, pin, level);
  fflush(edges);
}

static cycles_t noise_ends(avr_t *a, cycles_t w, void *p) { (void)a, (void)w, (void)p; avr_raise_irq(heard, 0); return 0; }
static cycles_t noise_begins(avr_t *a, cycles_t w, void *p) {
  (void)w, (void)p;
  avr_raise_irq(heard, 1);
  avr_cycle_timer_register(a, 1600, noise_ends, NULL);
  return 0;
}

static void move(cycles_t when, int pin, int level) {
  if (levels[pin] == level) return;
  levels[pin] = level;
  note(when, pin == 1 ? "valve" : "trigger", level);
  if (pin != 2) return;
  if (jumper) avr_raise_irq(heard, level);
  if (noise && level) avr_cycle_timer_register(avr, 3 * HZ / 1000, noise_begins, NULL);
}

static int mode(int unit) { return registers[TCCR1A] >> (unit ? 4 : 6) & 3; }

static void drive(cycles_t when, int unit) {
  move(when, unit + 1, mode(unit) ? remembered[unit] : registers[PORTB] >> (unit + 1) & 1);
}

static void matched(cycles_t when, int unit) {
  if (mode(unit) == 1) remembered[unit] ^= 1;
  if (mode(unit) > 1) remembered[unit] = mode(unit) == 3;
  drive(when, unit);
}

static cycles_t match(avr_t *a, cycles_t w, void *param) {
  (void)a, (void)w;
  int unit = (int)(intptr_t)param;
  cycles_t when = matches[unit];
  if (!started || !when) return 0;
  if (when > now()) return 0;  // another OCR was written meanwhile, whose own timer comes
  matches[unit] = 0;
  matched(when, unit);
  return 0;
}

static void expect(int unit) {
  int low = unit ? OCR1BL : OCR1AL;
  cycles_t when = started + 256 * (1 + (cycles_t)(registers[low] | registers[low + 1] << 8)), t = now();
  matches[unit] = started && when > t ? when : 0;
  if (matches[unit]) avr_cycle_timer_register(avr, when - t, match, (void *)(intptr_t)unit);
}

static void written(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  int at = (int)(intptr_t)param;
  registers[at] = (uint8_t)value;
  if (at == TCCR1B) {
    int runs = (value & 7) != 0;
    if (runs == (started != 0)) return;
    started = runs ? now() : 0;
    expect(0);
    expect(1);
  } else if (at == OCR1AL || at == OCR1BL) {
    if (started) expect(at == OCR1BL);
  } else if (at == TCCR1C) {
    if (value & 0x80) matched(now(), 0);
    if (value & 0x40) matched(now(), 1);
  } else if (at == TCCR1A || at == PORTB) {
    drive(now(), 0);
    drive(now(), 1);
  }
}

static void sent(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq, (void)param;
  char c = (char)value;
  if (write(line, &c, 1) < 0) return;  // nobody reads: what does not fit is lost
}

static void set_interlock(int open) {
  unsigned long state = 'D' | 1ul << 14 | (unsigned long)open << 22;  // name: 7 bits, mask: 8, value: 8; its bit 7
  avr_ioctl(avr, CODE('i', 'o', 'p', 'D'), &state);
  avr_raise_irq(interlock, open);
  note(now(), "interlock", open);
}

static void restarted(const char *by, int open) {
  base = latest;
  next_byte = latest + START;
  avr_cycle_timer_register(avr, far, never, NULL);
  memset(registers, 0, sizeof registers);
  memset(remembered, 0, sizeof remembered);
  started = 0;
  note(latest, by, 1);
  move(latest, 1, 0);  // a board that starts lets go of its pins, and resistors pull them down
  move(latest, 2, 0);
  set_interlock(open);
}

static void wait_for(const struct timespec *began, double speed) {
  for (;;) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    double ahead = (double)now() / HZ / speed - (t.tv_sec - began->tv_sec) - (t.tv_nsec - began->tv_nsec) / 1e9;
    if (ahead < 1e-4) return;
    usleep((useconds_t)(ahead * 1e6));
  }
}

int main(int count, char **given) {
  if (count != 5) return 2;
  void *library = dlopen("libsimavr.so.2", RTLD_NOW);
  if (!library) { fprintf(stderr, "%s\n", dlerror()); return 2; }
#define LOAD(name) load(library, #name, &name)
  LOAD(avr_make_mcu_by_name); LOAD(avr_init); LOAD(avr_run); LOAD(avr_ioctl); LOAD(elf_read_firmware);
  LOAD(avr_load_firmware); LOAD(avr_reset); LOAD(avr_io_getirq); LOAD(avr_irq_register_notify); LOAD(avr_raise_irq);
  LOAD(avr_cycle_timer_register); LOAD(avr_cycle_timer_status); LOAD(avr_iomem_getirq);
  static firmware_t firmware;
  if (elf_read_firmware(given[1], &firmware) || !(avr = avr_make_mcu_by_name("atmega328p"))) return 2;
  firmware.frequency = HZ;
  avr_init(avr);
  avr_load_firmware(avr, &firmware);
  line = atoi(given[2]);
  fcntl(line, F_SETFL, O_NONBLOCK);
  edges = fopen(given[3], "w");
  double speed = atof(given[4]);
  uint32_t quiet = 0;
  avr_ioctl(avr, CODE('u', 'a', 's', '0'), &quiet);
  uart = avr_io_getirq(avr, CODE('u', 'a', 'r', '0'), 0);
  avr_irq_register_notify(avr_io_getirq(avr, CODE('u', 'a', 'r', '0'), 1), sent, NULL);
  heard = avr_io_getirq(avr, CODE('i', 'o', 'g', 'B'), 0);
  interlock = avr_io_getirq(avr, CODE('i', 'o', 'g', 'D'), 7);
  static const int watched[] = {PORTB, TCCR1A, TCCR1B, TCCR1C, OCR1AL, OCR1AH, OCR1BL, OCR1BH};
  for (unsigned i = 0; i < sizeof watched / sizeof *watched; i++)
    avr_irq_register_notify(avr_iomem_getirq(avr, watched[i], NULL, 8), written, (void *)(intptr_t)watched[i]);
  avr_cycle_timer_register(avr, far, never, NULL);
  int open = 0, running = 1;
  set_interlock(open);
  struct timespec began;
  clock_gettime(CLOCK_MONOTONIC, &began);
  cycles_t look = 0;
  while (running) {
    for (int i = 0; i < BATCH; i++)
      if (avr_run(avr) >= 6) { fprintf(stderr, "the program crashed\n"); return 3; }
    if (!avr_cycle_timer_status(avr, never, NULL)) restarted("watchdog", open);
    cycles_t t = now();
    char c;
    if (t >= next_byte && read(line, &c, 1) == 1) {
      avr_raise_irq(uart, (uint8_t)c);
      next_byte = t + BYTE;
    }
    if (t < look) continue;
    look = t + AHEAD;
    struct pollfd orders = {0, POLLIN, 0};
    while (poll(&orders, 1, 0) > 0) {
      if (read(0, &c, 1) != 1 || c == 'q') { running = 0; break; }
      if (c == 'o' || c == 'c') set_interlock(open = c == 'o');
      if (c == 'r') { now(); avr_reset(avr); restarted("reset", open); }
      if (c == 't') note(now(), "time", 0);
      if (c == 'j') jumper = 0;
      if (c == 'n') noise = 1;
    }
    if (speed > 0) wait_for(&began, speed);
  }
  fclose(edges);
  return 0;
}
