// The sketch as the board's own program, with the little of Arduino's library that it uses: millis by Timer0, pins, and
// the serial port, which receives by interrupt into 64 bytes and sends by waiting.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdint.h>

typedef uint8_t byte;
enum { LOW, HIGH };
enum { INPUT, OUTPUT, INPUT_PULLUP };

static volatile unsigned long ms = 0;
ISR(TIMER0_OVF_vect) {  // each 1024 us
  static byte rest = 0;
  ms++;
  rest += 3;
  if (rest >= 125) { rest -= 125; ms++; }
}
unsigned long millis() {
  byte before = SREG;
  cli();
  unsigned long now = ms;
  SREG = before;
  return now;
}

static volatile uint8_t &port(byte pin) { return pin < 8 ? PORTD : PORTB; }
static byte bit(byte pin) { return _BV(pin < 8 ? pin : pin - 8); }
void digitalWrite(byte pin, byte level) { if (level) port(pin) |= bit(pin); else port(pin) &= ~bit(pin); }
int digitalRead(byte pin) { return (pin < 8 ? PIND : PINB) & bit(pin) ? HIGH : LOW; }
void pinMode(byte pin, byte mode) {
  volatile uint8_t &direction = pin < 8 ? DDRD : DDRB;
  if (mode == OUTPUT) direction |= bit(pin); else direction &= ~bit(pin);
  if (mode == INPUT_PULLUP) digitalWrite(pin, HIGH);
}

static volatile byte received[64], first = 0, last = 0;
ISR(USART_RX_vect) {
  byte c = UDR0;
  if (c == 0x07) for (;;) {}  // a program that is stuck, as a test wants it: only the watchdog ends that
  byte next = (last + 1) % sizeof received;
  if (next == first) return;
  received[last] = c;
  last = next;
}

struct {
  void begin(unsigned long baud) {
    UCSR0A = _BV(U2X0);
    UBRR0 = (F_CPU / 4 / baud - 1) / 2;
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
  }
  bool available() { return first != last; }
  char read() {
    char c = received[first];
    first = (first + 1) % sizeof received;
    return c;
  }
  void print(const char *text) { for (; *text; text++) send(*text); }
  void println(const char *text) { print(text); print("\r\n"); }
  void send(char c) {
    while (!(UCSR0A & _BV(UDRE0))) {}
    UDR0 = c;
  }
} Serial;

#include "sketch.h"

int main() {
  TCCR0B = _BV(CS01) | _BV(CS00);  // a 64th of the clock
  TIMSK0 = _BV(TOIE0);
  sei();
  setup();
  for (;;) loop();
}
