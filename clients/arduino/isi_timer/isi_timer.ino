// A timer for pairs of stimuli, for isiw.LineDevice: Arduino Uno or Nano (ATmega328P at 16 MHz).
//
// The valve (pin 9) and the stimulator's trigger (pin 10) are switched by the two compare units of Timer1, so no
// instruction of this program lies between them. Wiring, timing and configuration: docs/lab/arduino.md.
//
// Each command is a line with a number N, each answer has the same number. A line ends with * and its checksum, four
// hexadecimal digits: CRC-16/XMODEM of all before the *.
//
//   N HELLO    N TIMER 2 ms n  this protocol; the shortest interval between stimuli, and how many it gives at most
//   N SET us   N OK            the ISI from valve to trigger [us], 1 s at most; disarms
//   N GET      N ISI us        the ISI as it will be given, in steps of 16 us
//   N ACK      N CLOSED        the interlock was open, and somebody has seen why
//   N ARM      N ARMED         for one stimulus, and for HEARTBEAT_MS after each line, 2 s at most
//   N FIRE     N FIRED us      valve and trigger; the ISI as heard at pin 8
//   N ALONE    N FIRED         the trigger alone
//   N TAP      N FIRED         the valve alone
//   N BEAT                     the computer is there; no answer
//   N DISARM   N DISARMED
//
// Whatever it refuses is answered by N ERR and the reason. Whatever it does not understand disarms, and so does silence.
// What was numbered as the command before is not done again; its answer is repeated. While a stimulus is under way, any
// line but BEAT ends it at once, and so do a damaged line, an interlock that opens, and silence.

#include <stdlib.h>
#include <string.h>
#include <avr/wdt.h>

// What a lab sets. isiw compares the first two with its own limits.
#ifndef SHORTEST_INTERVAL_MS
#define SHORTEST_INTERVAL_MS 2000  // between two stimuli, and from the start to the first
#endif
#ifndef MOST_STIMULI
#define MOST_STIMULI 1000  // from one start to the next
#endif
#ifndef HEARTBEAT_MS
#define HEARTBEAT_MS 500  // the longest silence while it is armed or gives a stimulus
#endif
#ifndef VALVE_MS
#define VALVE_MS 60  // the valve is open
#endif

const byte INTERLOCK = 7;  // closed to ground while stimuli are allowed
const byte HEARD = 8;      // ICP1: wired to the trigger, pin 10
const byte VALVE = 9;      // OC1A
const byte TRIGGER = 10;   // OC1B

const unsigned long TICK_US = 16;  // 256 clocks of 16 MHz
const unsigned long LONGEST_US = 1000000;
const unsigned int LEAD_TICKS = 64;  // from the timer's start to the valve: 1 ms
const unsigned int VALVE_TICKS = VALVE_MS * 125UL / 2;
const unsigned int TRIGGER_TICKS = 63;  // the trigger is high for 1 ms
const unsigned long ARMED_MS = 2000, SHORTEST_MS = SHORTEST_INTERVAL_MS;

bool armed = false;
bool latched = false;  // the interlock was open, and nobody has acknowledged it
bool isiKnown = false;
unsigned int isiTicks = 0;
unsigned int given = 0;
unsigned long armedAtMs = 0, heardAtMs = 0, givenAtMs = 0;
unsigned long lastNumber = 0;
bool numbered = false;  // there was a command, whose number and answer are kept
char lastAnswer[48];

char line[32];
byte length = 0;
bool tooLong = false;
bool kept = false, keptWhole = false;  // a line that ended a stimulus and is still to be obeyed, and whether it is whole

// Both outputs low, and the timer at rest. A compare unit remembers its level, so it is made to forget a high one, or the
// next stimulus would begin with it.
void quiet() {
  TCCR1B = _BV(ICNC1) | _BV(ICES1);    // no clock; rising edges of pin 8 count, always: changing that may count as one
  TCCR1A = _BV(COM1A1) | _BV(COM1B1);  // low …
  TCCR1C = _BV(FOC1A) | _BV(FOC1B);    // … now
  TCCR1A = 0;                          // and plain outputs again, which are low
  digitalWrite(VALVE, LOW);
  digitalWrite(TRIGGER, LOW);
}

void disarm() {
  armed = false;
  quiet();
}

// The interlock's state; once it was open, it stays so until it is acknowledged.
bool allowed() {
  if (digitalRead(INTERLOCK) == LOW) return true;
  latched = true;
  return false;
}

void setup() {
  byte why = MCUSR;
  MCUSR = 0;
  wdt_disable();
  digitalWrite(VALVE, LOW);
  digitalWrite(TRIGGER, LOW);
  pinMode(VALVE, OUTPUT);
  pinMode(TRIGGER, OUTPUT);
  pinMode(HEARD, INPUT);
  pinMode(INTERLOCK, INPUT_PULLUP);
  disarm();
  latched = why & _BV(WDRF);  // this program was stuck: somebody has to know
  Serial.begin(115200);
  givenAtMs = millis();  // nobody knows what came before the start
  wdt_enable(WDTO_250MS);
}

void loop() {
  wdt_reset();
  if (!allowed()) disarm();
  if (armed && (millis() - armedAtMs > ARMED_MS || millis() - heardAtMs > HEARTBEAT_MS)) disarm();
  if (kept || hear()) obey();
}

// Take what has come; true if a line is there, whole or not.
bool hear() {
  while (Serial.available()) {
    char c = Serial.read();
    if (c == '\r') continue;
    if (c != '\n') {
      if (length < sizeof(line) - 1) line[length++] = c;
      else tooLong = true;
      continue;
    }
    if (length == 0) continue;
    line[length] = 0;
    return true;
  }
  return false;
}

unsigned int checksum(const char *text, byte size) {
  unsigned int crc = 0;
  for (byte at = 0; at < size; at++) {
    crc ^= (unsigned int)(byte)text[at] << 8;
    for (byte bit = 0; bit < 8; bit++) crc = (crc & 0x8000 ? crc << 1 ^ 0x1021 : crc << 1) & 0xFFFF;
  }
  return crc;
}

byte hexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  return c >= 'A' && c <= 'F' ? c - 'A' + 10 : 16;
}

// Whether the line is as it was sent; then without its checksum. The next one begins.
bool understood() {
  byte size = length;
  bool whole = !tooLong && size > 5 && line[size - 5] == '*';
  length = 0;
  tooLong = false;
  if (!whole || strlen(line) != size) return false;
  unsigned int stated = 0;
  for (byte at = size - 4; at < size; at++) {
    if (hexDigit(line[at]) > 15) return false;
    stated = stated << 4 | hexDigit(line[at]);
  }
  line[size - 5] = 0;
  return checksum(line, size - 5) == stated;
}

void say(const char *text) {
  char digits[7] = "*0000";
  unsigned int crc = checksum(text, strlen(text));
  for (byte at = 4; at > 0; at--, crc >>= 4) digits[at] = "0123456789ABCDEF"[crc & 15];
  Serial.print(text);
  Serial.println(digits);
}

void answer(unsigned long number, const char *word) {
  ultoa(number, lastAnswer, 10);
  strcat(lastAnswer, " ");
  strcat(lastAnswer, word);
  say(lastAnswer);
}

void answer(unsigned long number, const char *word, unsigned long us) {
  char text[24];
  strcpy(text, word);
  ultoa(us, text + strlen(text), 10);
  answer(number, text);
}

// Do not know what was meant, and so disarm.
void puzzled(unsigned long number, const char *why) {
  disarm();
  answer(number, why);
}

void obey() {
  bool whole = kept ? keptWhole : understood();
  kept = false;
  if (!whole) return puzzled(0, "ERR damaged line");
  char *rest;
  unsigned long number = strtoul(line, &rest, 10);
  if (rest == line || *rest != ' ') return puzzled(0, "ERR no number");
  char *verb = strtok(rest, " ");
  char *argument = strtok(NULL, " ");
  heardAtMs = millis();
  if (verb != NULL && strcmp(verb, "BEAT") == 0) return;
  bool again = numbered && number == lastNumber;
  if (verb != NULL && strcmp(verb, "DISARM") == 0) { disarm(); again = false; }
  if (again) return say(lastAnswer);
  lastNumber = number;
  numbered = true;
  if (verb == NULL) puzzled(number, "ERR no command");
  else if (strcmp(verb, "DISARM") == 0) answer(number, "DISARMED");
  else if (strcmp(verb, "HELLO") == 0) hello(number);
  else if (strcmp(verb, "SET") == 0) set(number, argument);
  else if (strcmp(verb, "GET") == 0) get(number);
  else if (strcmp(verb, "ACK") == 0) acknowledge(number);
  else if (strcmp(verb, "ARM") == 0) arm(number);
  else if (strcmp(verb, "FIRE") == 0) fire(number, true, true);
  else if (strcmp(verb, "ALONE") == 0) fire(number, false, true);
  else if (strcmp(verb, "TAP") == 0) fire(number, true, false);
  else puzzled(number, "ERR unknown command");
}

void hello(unsigned long number) {
  char text[40] = "TIMER 2 ";
  ultoa(SHORTEST_INTERVAL_MS, text + strlen(text), 10);
  strcat(text, " ");
  answer(number, text, MOST_STIMULI);
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
  answer(number, "ISI ", isiTicks * TICK_US);
}

void acknowledge(unsigned long number) {
  disarm();
  if (!allowed()) return answer(number, "ERR the interlock is open");
  latched = false;
  answer(number, "CLOSED");
}

// Why no stimulus is given now; NULL if one may be.
const char *refusal() {
  if (!allowed()) return "ERR the interlock is open";
  if (latched) return "ERR interlock was open";
  if (given >= MOST_STIMULI) return "ERR too many";
  if (millis() - givenAtMs < SHORTEST_MS) return "ERR too soon";
  return NULL;
}

void arm(unsigned long number) {
  const char *why = refusal();
  if (why != NULL) return puzzled(number, why);
  armed = true;
  armedAtMs = millis();
  answer(number, "ARMED");
}

void fire(unsigned long number, bool valve, bool trigger) {
  if (!armed) return answer(number, "ERR not armed");
  const char *why = valve && trigger && !isiKnown ? "ERR no ISI is set" : refusal();
  if (why != NULL) return puzzled(number, why);
  armed = false;
  given++;
  unsigned int heardTicks = 0;
  bool whole = give(valve, trigger, valve && trigger ? isiTicks : 0, heardTicks);
  givenAtMs = millis();
  if (!whole) return answer(number, "ERR stopped on the way");
  if (!trigger) return answer(number, "FIRED");
  if (heardTicks == 0) return answer(number, "ERR no trigger at pin 8");
  if (!valve) return answer(number, "FIRED");
  answer(number, "FIRED ", (unsigned int)(heardTicks - LEAD_TICKS - 1) * TICK_US);
}

// Whether a stimulus that is under way is to end before its time: the computer says something else than that it is
// there, or says nothing, or the interlock is open.
bool ended() {
  wdt_reset();
  if (!allowed() || millis() - heardAtMs > HEARTBEAT_MS || tooLong) return true;
  if (!hear()) return false;
  char *rest = line;
  keptWhole = understood();
  if (keptWhole) strtoul(line, &rest, 10);
  kept = !keptWhole || strcmp(rest, " BEAT") != 0;
  if (!kept) heardAtMs = millis();
  return kept;
}

// Switch valve and trigger on and off; whether it came to its end, and when the first rising edge came to pin 8. An
// output changes one tick after its match, so the valve opens at tick LEAD_TICKS + 1, and the trigger rises as many ticks
// later as it is told.
bool give(bool valve, bool trigger, unsigned int ticks, unsigned int &heardTicks) {
  const byte valveOn = _BV(COM1A1) | _BV(COM1A0), valveOff = _BV(COM1A1);
  const byte triggerOn = _BV(COM1B1) | _BV(COM1B0), triggerOff = _BV(COM1B1);
  byte valveEdges = valve ? 2 : 0, triggerEdges = trigger ? 2 : 0;  // still to come
  quiet();
  TCNT1 = 0;
  OCR1A = LEAD_TICKS;
  OCR1B = LEAD_TICKS + ticks;
  TIFR1 = _BV(OCF1A) | _BV(OCF1B) | _BV(ICF1);  // what was noted before is cleared by writing ones
  TCCR1A = (valve ? valveOn : 0) | (trigger ? triggerOn : 0);
  GTCCR = _BV(PSRSYNC);                           // the first tick is a whole one
  TCCR1B = _BV(ICNC1) | _BV(ICES1) | _BV(CS12);  // go, a tick each 256 clocks
  while (valveEdges > 0 || triggerEdges > 0) {
    if (ended()) { disarm(); return false; }
    byte seen = TIFR1;
    if (heardTicks == 0 && (seen & _BV(ICF1))) heardTicks = ICR1;  // later edges are artefacts
    if (valveEdges > 0 && (seen & _BV(OCF1A))) {
      OCR1A = LEAD_TICKS + VALVE_TICKS;
      TCCR1A = (TCCR1A & ~valveOn) | valveOff;
      valveEdges--;
    }
    if (triggerEdges > 0 && (seen & _BV(OCF1B))) {
      OCR1B = LEAD_TICKS + ticks + TRIGGER_TICKS;
      TCCR1A = (TCCR1A & ~triggerOn) | triggerOff;
      triggerEdges--;
    }
    if (seen & (_BV(OCF1A) | _BV(OCF1B))) TIFR1 = seen & (_BV(OCF1A) | _BV(OCF1B));
  }
  quiet();
  return true;
}
