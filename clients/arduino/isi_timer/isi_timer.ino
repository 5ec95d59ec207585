// A timer for pairs of stimuli, for isiw.LineDevice: Arduino Uno or Nano (ATmega328P at 16 MHz).
//
// The valve (pin 9) and the stimulator's trigger (pin 10) are switched by the two compare units of Timer1, so no
// instruction of this program lies between them. Wiring, timing and configuration: docs/lab/arduino.md.
//
// Each command is a line with a number N, each answer has the same number:
//
//   N SET us   N OK            the ISI from valve to trigger [us], 1 s at most; disarms
//   N GET      N ISI us        the ISI as it will be given, in steps of 16 us
//   N ARM      N ARMED         for 2 s, and for one stimulus
//   N FIRE     N FIRED us      valve and trigger; the ISI as heard at pin 8
//   N ALONE    N FIRED         the trigger alone
//   N TAP      N FIRED         the valve alone
//   N DISARM   N DISARMED
//
// Whatever it refuses is answered by N ERR and the reason. Any byte that comes while a stimulus is under way, and an
// interlock that opens, ends it at once.

#include <stdlib.h>
#include <string.h>

const byte INTERLOCK = 7;  // closed to ground while stimuli are allowed
const byte HEARD = 8;      // ICP1: wired to the trigger, pin 10
const byte VALVE = 9;      // OC1A
const byte TRIGGER = 10;   // OC1B

const unsigned long TICK_US = 16;  // 256 clocks of 16 MHz
const unsigned long LONGEST_US = 1000000;
const unsigned int LEAD_TICKS = 64;       // from the timer's start to the valve: 1 ms
const unsigned int VALVE_TICKS = 3750;    // the valve is open for 60 ms
const unsigned int TRIGGER_TICKS = 63;    // the trigger is high for 1 ms
const unsigned long ARMED_MS = 2000;

bool armed = false;
bool isiKnown = false;
unsigned int isiTicks = 0;
unsigned long armedAtMs = 0;

char line[32];
byte length = 0;
bool tooLong = false;

// Both outputs low, and the timer at rest. A compare unit remembers its level, so it is made to forget a high one, or the
// next stimulus would begin with it.
void quiet() {
  TCCR1B = _BV(ICES1);                 // no clock; rising edges of pin 8 count, always: changing that may count as one
  TCCR1A = _BV(COM1A1) | _BV(COM1B1);  // low …
  TCCR1C = _BV(FOC1A) | _BV(FOC1B);    // … now
  TCCR1A = 0;                          // and plain outputs again, which are low
}

void disarm() {
  armed = false;
  quiet();
}

bool allowed() { return digitalRead(INTERLOCK) == LOW; }

void setup() {
  digitalWrite(VALVE, LOW);
  digitalWrite(TRIGGER, LOW);
  pinMode(VALVE, OUTPUT);
  pinMode(TRIGGER, OUTPUT);
  pinMode(HEARD, INPUT);
  pinMode(INTERLOCK, INPUT_PULLUP);
  disarm();
  Serial.begin(115200);
}

void loop() {
  if (armed && (!allowed() || millis() - armedAtMs > ARMED_MS)) disarm();
  if (!Serial.available()) return;
  char c = Serial.read();
  if (c == '\r') return;
  if (c != '\n') {
    if (length < sizeof(line) - 1) line[length++] = c;
    else tooLong = true;
    return;
  }
  line[length] = 0;
  if (length > 0 && !tooLong) obey();
  length = 0;
  tooLong = false;
}

void answer(unsigned long number, const char *text) {
  Serial.print(number);
  Serial.print(' ');
  Serial.println(text);
}

void answer(unsigned long number, const char *word, unsigned long us) {
  Serial.print(number);
  Serial.print(' ');
  Serial.print(word);
  Serial.print(' ');
  Serial.println(us);
}

void obey() {
  char *rest;
  unsigned long number = strtoul(line, &rest, 10);
  char *verb = strtok(rest, " ");
  char *argument = strtok(NULL, " ");
  if (verb == NULL) answer(number, "ERR no command");
  else if (strcmp(verb, "DISARM") == 0) { disarm(); answer(number, "DISARMED"); }
  else if (strcmp(verb, "SET") == 0) set(number, argument);
  else if (strcmp(verb, "GET") == 0) get(number);
  else if (strcmp(verb, "ARM") == 0) arm(number);
  else if (strcmp(verb, "FIRE") == 0) fire(number, true, true);
  else if (strcmp(verb, "ALONE") == 0) fire(number, false, true);
  else if (strcmp(verb, "TAP") == 0) fire(number, true, false);
  else answer(number, "ERR unknown command");
}

void set(unsigned long number, const char *argument) {
  char *end = NULL;
  unsigned long us = argument == NULL ? 0 : strtoul(argument, &end, 10);
  disarm();
  isiKnown = false;
  if (end == NULL || *end != 0 || end == argument || *argument == '-') return answer(number, "ERR no time");
  if (us > LONGEST_US) return answer(number, "ERR too long");
  isiTicks = (us + TICK_US / 2) / TICK_US;
  isiKnown = true;
  answer(number, "OK");
}

void get(unsigned long number) {
  if (!isiKnown) return answer(number, "ERR no ISI is set");
  answer(number, "ISI", isiTicks * TICK_US);
}

void arm(unsigned long number) {
  if (!allowed()) return answer(number, "ERR the interlock is open");
  armed = true;
  armedAtMs = millis();
  answer(number, "ARMED");
}

void fire(unsigned long number, bool valve, bool trigger) {
  if (!armed) return answer(number, "ERR not armed");
  if (valve && trigger && !isiKnown) return answer(number, "ERR no ISI is set");
  armed = false;
  if (!give(valve, trigger, valve && trigger ? isiTicks : 0)) return answer(number, "ERR stopped on the way");
  if (!trigger) return answer(number, "FIRED");
  if (!(TIFR1 & _BV(ICF1))) return answer(number, "ERR no trigger at pin 8");
  if (!valve) return answer(number, "FIRED");
  answer(number, "FIRED", (unsigned int)(ICR1 - LEAD_TICKS - 1) * TICK_US);
}

// Switch valve and trigger on and off; whether it came to its end. An output changes one tick after its match, so the
// valve opens at tick LEAD_TICKS + 1, and the trigger rises as many ticks later as it is told.
bool give(bool valve, bool trigger, unsigned int ticks) {
  const byte valveOn = _BV(COM1A1) | _BV(COM1A0), valveOff = _BV(COM1A1);
  const byte triggerOn = _BV(COM1B1) | _BV(COM1B0), triggerOff = _BV(COM1B1);
  byte valveEdges = valve ? 2 : 0, triggerEdges = trigger ? 2 : 0;  // still to come
  quiet();
  TCNT1 = 0;
  OCR1A = LEAD_TICKS;
  OCR1B = LEAD_TICKS + ticks;
  TIFR1 = _BV(OCF1A) | _BV(OCF1B) | _BV(ICF1);  // what was noted before is cleared by writing ones
  TCCR1A = (valve ? valveOn : 0) | (trigger ? triggerOn : 0);
  GTCCR = _BV(PSRSYNC);             // the first tick is a whole one
  TCCR1B = _BV(ICES1) | _BV(CS12);  // go, a tick each 256 clocks
  while (valveEdges > 0 || triggerEdges > 0) {
    if (Serial.available() || !allowed()) { disarm(); return false; }
    if (valveEdges > 0 && (TIFR1 & _BV(OCF1A))) {
      OCR1A = LEAD_TICKS + VALVE_TICKS;
      TCCR1A = (TCCR1A & ~valveOn) | valveOff;
      TIFR1 = _BV(OCF1A);
      valveEdges--;
    }
    if (triggerEdges > 0 && (TIFR1 & _BV(OCF1B))) {
      OCR1B = LEAD_TICKS + ticks + TRIGGER_TICKS;
      TCCR1A = (TCCR1A & ~triggerOn) | triggerOff;
      TIFR1 = _BV(OCF1B);
      triggerEdges--;
    }
  }
  quiet();
  return true;
}
