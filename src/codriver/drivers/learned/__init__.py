"""How a driver steers, learned from drives: the torque to come, with a band (2019, sections 2 and 5).

feature_setting, features, road_ahead, smoothing, scaling    the vector z of eq. (1) from a log
regressor, kinds                                             what a model is; the models by name, one a file
protocol, evaluate                                           what is held out; tables with the baselines in them
calibration                                                  bands that hold what they promise
learned_driver, driver_file                                  a driver as a value, and as a file
recognise                                                    which of several drivers is this?
driver_observer                                              a driver as an Observer: batch, live, C
"""
