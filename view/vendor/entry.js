// What the page takes of three.js, by name, so that the rest stays out.
export {
  AxesHelper, BackSide, BufferAttribute, BufferGeometry, BoxGeometry, Color, CylinderGeometry, DirectionalLight,
  DoubleSide, GridHelper, Group, HemisphereLight, InstancedMesh, LineBasicMaterial,
  LineSegments, LoadingManager, Matrix4, Mesh, MeshBasicMaterial,
  MeshStandardMaterial, PCFShadowMap, PerspectiveCamera, PlaneGeometry, Quaternion, Raycaster, Scene,
  ShadowMaterial, SphereGeometry, Vector2, Vector3, WebGLRenderer,
} from 'three';
export { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
export { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
export { LineSegments2 } from 'three/examples/jsm/lines/LineSegments2.js';
export { LineSegmentsGeometry } from 'three/examples/jsm/lines/LineSegmentsGeometry.js';
export { ColladaLoader } from 'three/examples/jsm/loaders/ColladaLoader.js';
export { OBJLoader } from 'three/examples/jsm/loaders/OBJLoader.js';
export { STLLoader } from 'three/examples/jsm/loaders/STLLoader.js';
