// The default light of rviz, which shines from the camera.

import * as THREE from "three";

export class Headlight {
  constructor(world) {
    this.lamp = new THREE.DirectionalLight(0xffffff, Math.PI);
    world.add(this.lamp, this.lamp.target);
  }

  // From 0 to 1.
  get brightness() {
    return this.lamp.intensity / Math.PI;
  }

  aim(camera, isOn) {
    this.lamp.intensity = isOn ? Math.PI : 0;
    this.lamp.position.copy(camera.position);
    this.lamp.target.position.copy(camera.position).add(camera.getWorldDirection(new THREE.Vector3()));
    this.lamp.target.updateMatrixWorld();
  }
}
