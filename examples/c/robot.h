/* A robot on a floor that tilts, whose IMU has biases: it replaces the drivers of an IMU and of wheels. */
#ifndef ROBOT_H
#define ROBOT_H

#include "tumble.h"

/* The truth, which a spin is to find: m/s^2 and rad/s. */
extern const float robot_force_bias[3];
extern const float robot_rate_bias[3];

/* Lets the wheels turn the robot on the spot, rad/s counter-clockwise. */
void robot_turn(float rate);

/* Waits for the next sample, which comes every 10 ms. */
struct tumble_sample robot_read(void);

/* State of the wheels. */
tumble_wheels robot_wheels(void);

#endif
