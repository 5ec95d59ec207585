#!/usr/bin/env bash
# simavr: clearing one flag of a timer clears all of them.
#
# Expected: ATmega328P data sheet, TIFR1: OCF1A, OCF1B and TOV1 are each cleared by writing a one to its own bit; a bit that is
#   written as zero keeps its flag.
# Seen: with timer 1 past both compare values (OCF1A and OCF1B set, 0x06), TIFR1 = 1 << OCF1A leaves 0x00, not 0x04.
# Hurts: firmware that times two edges with the two compare units and polls their flags (a pair of pulses, for example)
#   loses the second edge in the simulator though it is right on the chip: a test in simavr fails correct code, and
#   code that clears flags with |= (a fault on the chip, where it clears all) looks the same as correct code.
# Needs the Debian packages simavr and gcc-avr with avr-libc; skips nothing: without them it fails.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
for program in simavr avr-gcc; do
    command -v "$program" >/dev/null || { echo "$program is missing: apt-get install simavr gcc-avr avr-libc"; exit 1; }
done
cd "$tmp"
cat >flags.c <<'C'
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

static void put(char c) {
    while (!(UCSR0A & (1 << UDRE0))) {}
    UDR0 = c;
}

static void put_hex(uint8_t v) {
    put("0123456789abcdef"[v >> 4]);
    put("0123456789abcdef"[v & 15]);
}

int main(void) {
    UCSR0B = 1 << TXEN0;
    TCCR1A = 0;
    OCR1A = 100;
    OCR1B = 200;
    TCNT1 = 0;
    TCCR1B = 1 << CS10; /* counts cycles; 2000 are far below the overflow at 65536 */
    for (volatile uint16_t i = 0; i < 500; i++) {}
    uint8_t before = TIFR1;
    TIFR1 = 1 << OCF1A;
    uint8_t after = TIFR1;
    put_hex(before);
    put('>');
    put_hex(after);
    put('\n');
    cli(); /* sleeping with interrupts off ends the simulation */
    sleep_enable();
    sleep_cpu();
    for (;;) {}
}
C
avr-gcc -mmcu=atmega328p -DF_CPU=16000000UL -Os flags.c -o flags.elf
output=$(timeout 20 simavr -m atmega328p -f 16000000 flags.elf 2>&1 || true)
flags=$(grep -oE '[0-9a-f]{2}>[0-9a-f]{2}' <<<"$output" | head -n 1 || true)
dpkg-query -W -f '${Package} ${Version}\n' simavr gcc-avr avr-libc 2>/dev/null || true
echo "TIFR1 before and after writing 1 << OCF1A (0x02): $flags; the data sheet has 06>04"
if [ "$flags" = "06>00" ]; then echo "as described"; else echo "CHANGED"; exit 1; fi
