// Stand-ins for what the sketch uses of an Arduino Uno, so that it runs on a computer: Timer1 follows the computer's
// clock, Serial is standard input and output, and each edge of the two outputs is written to the file EDGES names.
// The interlock is closed while the file INTERLOCK names does not exist.
#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <poll.h>
#include <string>
#include <unistd.h>

using byte = uint8_t;
enum { LOW, HIGH, INPUT, OUTPUT, INPUT_PULLUP };
#define _BV(bit) (1 << (bit))
enum { COM1B0 = 4, COM1B1, COM1A0, COM1A1 };
enum { CS12 = 2, ICES1 = 6, ICNC1 };
enum { WDRF = 3 };
enum { FOC1B = 6, FOC1A };
enum { OCF1A = 1, OCF1B, ICF1 = 5 };
enum { PSRSYNC = 0 };

inline double nowUs() {
  using namespace std::chrono;
  return duration<double, std::micro>(steady_clock::now().time_since_epoch()).count();
}
inline unsigned long millis() { return static_cast<unsigned long>(nowUs() / 1000); }

inline uint8_t TCCR1A = 0, GTCCR = 0, MCUSR = 0, flags = 0;
inline uint16_t TCNT1 = 0, OCR1A = 0, OCR1B = 0, ICR1 = 0;
inline bool jumper = std::getenv("NO_JUMPER") == nullptr;
inline double startedUs = 0, looked = 0;
inline bool valveHigh = false, triggerHigh = false;  // what the compare units remember

inline void edge(const char *pin, bool high, double ticks) {
  (pin[0] == 'v' ? valveHigh : triggerHigh) = high;
  std::ofstream(std::getenv("EDGES"), std::ios::app) << pin << ' ' << high << ' ' << ticks * 16 << std::endl;
}

// What the compare units have done since they were looked at last.
inline void matches(const char *pin, uint16_t at, int shift, uint8_t flag, double ticks) {
  if (!(looked < at + 1 && at + 1 <= ticks)) return;
  flags |= _BV(flag);
  int mode = TCCR1A >> shift & 3;
  if (mode < 2) return;
  edge(pin, mode == 3, at + 1);
  if (flag == OCF1B && mode == 3 && jumper) { ICR1 = at + 1; flags |= _BV(ICF1); }
}

struct {
  operator uint8_t() {
    double ticks = std::min((nowUs() - startedUs) / 16, looked + 30);  // a board does nothing else meanwhile
    matches("valve", OCR1A, COM1A0, OCF1A, ticks);
    matches("trigger", OCR1B, COM1B0, OCF1B, ticks);
    looked = ticks;
    return flags;
  }
  void operator=(int cleared) { flags &= ~cleared; }
} inline TIFR1;

struct {
  void operator=(int value) {
    if (!(value & _BV(CS12))) return;
    startedUs = nowUs();
    looked = 0;
    if (valveHigh && TCCR1A >> COM1A0 & 3) edge("valve", true, 0);  // a level that was remembered
    if (triggerHigh && TCCR1A >> COM1B0 & 3) edge("trigger", true, 0);
  }
} inline TCCR1B;

struct {
  void operator=(int value) {
    if (value & _BV(FOC1A) && valveHigh && (TCCR1A >> COM1A0 & 3) == 2) edge("valve", false, -1);
    if (value & _BV(FOC1B) && triggerHigh && (TCCR1A >> COM1B0 & 3) == 2) edge("trigger", false, -1);
  }
} inline TCCR1C;

inline char *ultoa(unsigned long n, char *text, int) {
  std::sprintf(text, "%lu", n);
  return text;
}
inline void pinMode(byte, byte) {}
inline void digitalWrite(byte, byte) {}
inline int digitalRead(byte) { return access(std::getenv("INTERLOCK"), F_OK) == 0 ? HIGH : LOW; }

struct {
  void begin(long) {}
  int available() {
    pollfd input{0, POLLIN, 0};
    return poll(&input, 1, 0) > 0;
  }
  int read() {
    char c;
    if (::read(0, &c, 1) != 1) std::exit(0);
    return c;
  }
  void send(const std::string &text) { if (::write(1, text.data(), text.size()) < 0) std::exit(1); }
  void print(const char *text) { send(text); }
  void println(const char *text) { send(std::string(text) + "\r\n"); }
} inline Serial;
