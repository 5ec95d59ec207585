// The sketch as a program: its prototypes, which the Arduino IDE writes by itself, and its loop.
#include "Arduino.h"
void obey();
void set(unsigned long number, const char *argument);
void get(unsigned long number);
void arm(unsigned long number);
void fire(unsigned long number, bool valve, bool trigger);
bool give(bool valve, bool trigger, unsigned int ticks);
#include "../../../clients/arduino/isi_timer/isi_timer.ino"

int main() {
  setup();
  for (;;) { loop(); if (!armed) usleep(100); }
}
