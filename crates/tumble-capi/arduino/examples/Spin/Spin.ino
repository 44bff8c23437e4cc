/*
  Finds the biases of an MPU-6050 on a robot: it stands still, turns on the spot when asked to, and from then on its readings
  are printed without them, m/s^2 and rad/s. The chip's axes are taken for the robot's: x forward, z up.
*/
#include <Wire.h>
#include <tumble.h>

const uint8_t ADDRESS = 0x68;
const float FORCE = 9.80665f / 16384.0f;         // m/s^2 a count, at a range of 2 g
const float RATE = 3.14159265f / 180.0f / 65.5f; // rad/s a count, at a range of 500 degrees a second

static tumble_spin spin;
static tumble_correction correction;
static bool calibrated;
static uint64_t now;

void setRegister(uint8_t place, uint8_t value) {
    Wire.beginTransmission(ADDRESS);
    Wire.write(place);
    Wire.write(value);
    Wire.endTransmission();
}

int16_t readWord() {
    const uint8_t high = (uint8_t)Wire.read();
    return (int16_t)(high << 8 | (uint8_t)Wire.read());
}

tumble_sample readChip() {
    tumble_sample sample;
    Wire.beginTransmission(ADDRESS);
    Wire.write((uint8_t)0x3B);
    Wire.endTransmission(false);
    Wire.requestFrom(ADDRESS, (uint8_t)14);
    for (int axis = 0; axis < 3; axis++) sample.specific_force[axis] = FORCE * readWord();
    readWord(); // temperature
    for (int axis = 0; axis < 3; axis++) sample.angular_rate[axis] = RATE * readWord();
    now += (uint32_t)micros() - (uint32_t)now; // micros() begins anew after 71 minutes
    sample.time = now;
    return sample;
}

void print(const char *name, const float value[3]) {
    Serial.print(name);
    for (int axis = 0; axis < 3; axis++) {
        Serial.print(" ");
        Serial.print(value[axis], 4);
    }
    Serial.println();
}

bool startSpin() {
    tumble_spin_settings settings;
    return tumble_spin_defaults(&settings) == TUMBLE_OK && tumble_spin_init(&spin, sizeof spin, &settings) == TUMBLE_OK &&
           tumble_spin_start(&spin) == TUMBLE_OK;
}

bool solveSpin() {
    tumble_spin_estimate found;
    tumble_record force, rate;
    if (tumble_spin_solve(&spin, NULL, &found, NULL) != TUMBLE_OK ||
        tumble_record_from_spin(&force, 1, TUMBLE_SENSOR_ACCELEROMETER, &found) != TUMBLE_OK ||
        tumble_record_from_spin(&rate, 1, TUMBLE_SENSOR_GYROSCOPE, &found) != TUMBLE_OK ||
        tumble_correction_from_records(&correction, &force, &rate) != TUMBLE_OK) return false;
    print("accelerometer bias", found.accelerometer_bias.value);
    print("gyroscope bias", found.gyroscope_bias.value);
    return true;
}

void setup() {
    Serial.begin(115200);
    Wire.begin();
    setRegister(0x6B, 0x00); // awake
    setRegister(0x1B, 0x08); // 500 degrees a second
    setRegister(0x1C, 0x00); // 2 g
    Serial.println(startSpin() ? "stand still" : "no spin");
}

void loop() {
    tumble_sample sample = readChip();
    if (calibrated) {
        tumble_correction_apply(&correction, &sample, &sample);
        print("force", sample.specific_force);
        print("rate", sample.angular_rate);
    } else {
        tumble_spin_event event = TUMBLE_SPIN_EVENT_NONE;
        tumble_spin_push(&spin, &sample, TUMBLE_WHEELS_UNKNOWN, &event);
        if (event == TUMBLE_SPIN_EVENT_STILL_DONE) Serial.println("turn on the spot, twice or more");
        if (event == TUMBLE_SPIN_EVENT_DONE) calibrated = solveSpin();
        if (event == TUMBLE_SPIN_EVENT_FAILED) Serial.println(startSpin() ? "once more: stand still" : "no spin");
    }
    delay(calibrated ? 100 : 4);
}
